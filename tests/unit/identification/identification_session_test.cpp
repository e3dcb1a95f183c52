// The course that all kinds of identification take, by the table of an invented one.

#include "server/identification/session/identification_session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "identified.h"

namespace hapticd::identification {
namespace {

using namespace test;
using Motion = MotionRequest::Motion;

const Kind& invented_kind() {
  static const Kind kind{
      .place = "invented identification",
      .fit_x = "force [N]",
      .fit_y = "depth [mm]",
      .coverage = {{{"speed", "mm/s", 0.0, 100.0, 2},
                    {"tilt", "°", -10.0, 10.0, 2},
                    {{1, 0, "faster, to the left"}, {0, 1, "slower, to the right"}},
                    0.1},
                   {{"turn", "°", 0.0, 30.0, 3}, {"", "", 0.0, 1.0, 0}, {{2, 0, "turn it"}}, 0.2}},
      .motions = {{.motion = Motion::kSway, .words = "sway"}, {.motion = Motion::kTap, .words = "tap"}},
      .remedy_of_bad_model = "measure again"};
  return kind;
}

class InventedIdentification final : public IdentificationSession {
 public:
  InventedIdentification() : IdentificationSession(invented_kind(), 20.0) {
    says.residual = std::numeric_limits<double>::quiet_NaN();
  }
  void add(const rt::Observation& /*observation*/) override {}
  using IdentificationSession::visit;

  IdentificationProgress says;  ///< of the estimator
  double threshold_n = 0.02;
  std::size_t motions_done = 0;
  bool is_refused = false;

 private:
  void find(IdentificationProgress& progress) const override {
    const bool covered = progress.missing.empty();
    progress.steady = says.steady;
    progress.certain = says.certain;
    progress.residual = std::isnan(says.residual) ? progress.residual : says.residual;
    progress.parameters = says.parameters;
    progress.missing.emplace_back("go on");
    progress.converged = covered;
    progress.completion = says.completion;
  }
  std::optional<hal::Error> conclude(const IdentificationProgress& now,
                                     rt::IdentifiedModel& model) const override {
    if (is_refused) return refusal("nothing was seen", "0", "1", now.missing.front());
    rt::ThresholdModel threshold{.threshold_n = threshold_n, .largest_residual_n = 0.01, .observed_s = 10.0};
    model.content = threshold;
    model.procedure = "invented";
    return std::nullopt;
  }
  std::size_t turn() const override { return motions_done; }
};

void cover(InventedIdentification& identification) {
  for (int i = 0; i < 4; ++i) {
    identification.visit(0, 80.0, -5.0);
    identification.visit(0, 20.0, 5.0);
    identification.visit(1, 25.0);
  }
}

TEST(IdentificationSession, NamesTheCellsThatItsTableRequiresInOrder) {
  InventedIdentification identification;
  using Words = std::vector<std::string>;
  EXPECT_EQ(identification.progress().missing,
            (Words{"faster, to the left", "slower, to the right", "turn it", "go on"}));
  identification.visit(0, 80.0, -5.0);
  EXPECT_EQ(identification.progress().coverage[0].share, 0.0) << "0.1 s are two samples";
  identification.visit(0, 80.0, -5.0);
  identification.visit(1, 10.0);
  const IdentificationProgress progress = identification.progress();
  EXPECT_EQ(progress.missing, (Words{"slower, to the right", "turn it", "go on"}));
  ASSERT_EQ(progress.coverage.size(), 2U);
  EXPECT_EQ(progress.coverage[0].share, 0.5);
  EXPECT_EQ(progress.coverage[0].counts, (std::vector<std::uint32_t>{0, 2, 0, 0}));
  EXPECT_EQ(progress.coverage[1].counts, (std::vector<std::uint32_t>{0, 1, 0}));
  EXPECT_EQ(progress.fit_x, "force [N]");
  EXPECT_EQ(progress.fit_y, "depth [mm]");
  EXPECT_TRUE(std::isnan(progress.residual)) << "no fit yet";
}

TEST(IdentificationSession, HasConvergedWhereItIsCoveredSteadyAndCertain) {
  for (const bool is_covered : {false, true}) {
    for (const bool steady : {false, true}) {
      for (const bool certain : {false, true}) {
        InventedIdentification identification;
        if (is_covered) cover(identification);
        identification.says.steady = steady;
        identification.says.certain = certain;
        const IdentificationProgress progress = identification.progress();
        EXPECT_EQ(progress.converged, is_covered && steady && certain);
        EXPECT_EQ(progress.missing.empty(), progress.converged);
        EXPECT_EQ(progress.completion == 1.0, progress.converged);
        EXPECT_EQ(identification.next_request().motion == Motion::kRest, progress.converged);
      }
    }
  }
}

TEST(IdentificationSession, AsksForItsMotionsInTurn) {
  InventedIdentification identification;
  for (const char* words : {"sway", "tap", "sway"}) {
    EXPECT_EQ(identification.next_request().words, words);
    ++identification.motions_done;
  }
}

TEST(IdentificationSession, CompletionNeverFalls) {
  InventedIdentification identification;
  for (const double done : {0.2, 0.7, 0.3}) {
    identification.says.completion = done;
    (void)identification.progress();
  }
  EXPECT_EQ(identification.progress().completion, 0.7);
}

TEST(IdentificationSession, AModelHasWhatTheProgressSays) {
  InventedIdentification identification;
  identification.says.parameters = {{"threshold_n", "N", 0.02, 0.001}};
  auto model = identification.finish();
  ASSERT_TRUE(model) << model.error().text();
  EXPECT_EQ(model->residual, 0.0) << "no fit";
  EXPECT_FALSE(model->converged);
  EXPECT_EQ(model->parameters.front().value, 0.02);
  cover(identification);
  identification.says.residual = 0.25;
  identification.says.steady = identification.says.certain = true;
  model = identification.finish();
  ASSERT_TRUE(model);
  EXPECT_EQ(model->residual, 0.25);
  EXPECT_TRUE(model->converged);
}

TEST(IdentificationSession, RefusesInTheNameOfItsKind) {
  InventedIdentification identification;
  identification.threshold_n = -1.0;
  const hal::Error bad = refusal_of(identification);
  EXPECT_EQ(bad.remedy, "measure again");
  identification.is_refused = true;
  const hal::Error refused = refusal_of(identification);
  EXPECT_EQ(refused.where, "invented identification");
  EXPECT_EQ(refused.remedy, "faster, to the left");
}

TEST(IdentificationSession, WhatLiesBeyondAnEndCountsInTheLastBin) {
  const Coverage coverage({"x", "mm", -10.0, 10.0, 4}, {"y", "N", 0.0, 3.0, 3});
  EXPECT_EQ(coverage.cell_at(-99.0, -1.0), 0U);
  EXPECT_EQ(coverage.cell_at(-5.0, 0.999), 1U);
  EXPECT_EQ(coverage.cell_at(99.0, 99.0), 11U);
  EXPECT_EQ(coverage.cell_at(std::numeric_limits<double>::quiet_NaN(), 3.0), 8U);
  EXPECT_EQ(coverage.counts.size(), 12U);
}

/// A table that names a cell outside its plan would write past the end.
TEST(IdentificationSession, TablesAskForCellsAndMotionsThatExist) {
  for (const Kind* kind : {&contact_kind(), &friction_kind(), &gains_kind(), &inclusion_kind(),
                           &structural_kind(), &threshold_kind(), &tool_kind()}) {
    for (const CoveragePlan& plan : kind->coverage) {
      EXPECT_FALSE(plan.required.empty()) << kind->place;
      for (const RequiredCell& cell : plan.required) {
        EXPECT_TRUE(cell.x >= 0 && cell.x < plan.x.bins) << kind->place;
        EXPECT_TRUE(cell.y >= 0 && cell.y < std::max(1, plan.y.bins)) << kind->place;
        EXPECT_FALSE(std::string(cell.words).empty()) << kind->place;
      }
    }
    for (const MotionRequest& motion : kind->motions) EXPECT_FALSE(motion.words.empty()) << kind->place;
  }
}

}  // namespace
}  // namespace hapticd::identification
