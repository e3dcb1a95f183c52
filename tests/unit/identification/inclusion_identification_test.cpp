// The session of an inclusion: what it asks for, what it finds, and what it refuses. The presses are made
// here, by the law itself, with noise.

#include "server/identification/session/inclusion/inclusion_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "hidden_inclusion.h"
#include "identified.h"

namespace hapticd::identification {
namespace {

using namespace test;

using hal::Vector3;

constexpr rt::HuntCrossleyParameters kOwnLaw{0.1, 2e-5, 1.2};

hal::RigInfo session_rig(hal::RigKind kind) {
  hal::RigInfo info;
  info.kind = kind;
  info.rate_hz = 1000.0;
  return info;
}

/// The presses are made by a point.
InclusionTask pressed_by_point() {
  InclusionTask task;
  task.tip_radius_mm = 0.0;
  return task;
}

/// A hand that presses straight down, a tick at a time.
class MadePresses {
 public:
  MadePresses(Identification& identification, const rt::InclusionParameters* inclusion)
      : identification_(identification), inclusion_(inclusion) {}

  void press(double x, double y, double depth_mm = 11.0) {
    const double z = surface_z_mm(x, y);
    for (int i = 0; i < 1000; ++i) {
      const double share = 0.5 * (1.0 - std::cos(2.0 * M_PI * i / 1000.0));
      const double rate = depth_mm * M_PI / 1.0 * std::sin(2.0 * M_PI * i / 1000.0);
      tick({x, y, z + 3.0 - (depth_mm + 3.0) * share}, -rate * (depth_mm + 3.0) / depth_mm);
    }
  }
  void tick(const Vector3& tip_mm, double up_mm_per_s) {
    const Vector3 out = tip_mm + Vector3{0.0, 0.0, kRadiusMm};
    rt::Indentation at{tip_mm, out * (1.0 / rt::norm(out)), kRadiusMm - rt::norm(out), 0.0};
    at.rate_mm_per_s = -at.normal.z * up_mm_per_s;
    rt::Observation observation;
    observation.sample.time_ns = tick_++ * 1'000'000;
    observation.sample.force_count = 1;
    observation.sample.tip_position_mm = tip_mm;
    Vector3 force{noise_(random_), noise_(random_), noise_(random_)};
    if (at.displacement_mm > 0.0) {
      force = force + at.normal * rt::hunt_crossley_force_n(kOwnLaw, at.displacement_mm, at.rate_mm_per_s);
      if (inclusion_ != nullptr) force = force + rt::energy_force_n(*inclusion_, at);
    }
    observation.sample.sensor_force_n = force + Vector3{0.0, 0.0, zero_n};
    identification_.add(observation);
  }
  void grid(double spacing_mm = 8.0) {
    for (int i = -3; i <= 3; ++i)
      for (int j = -3; j <= 3; ++j) press(spacing_mm * i, spacing_mm * j);
  }
  double zero_n = 0.0;

 private:
  Identification& identification_;
  const rt::InclusionParameters* inclusion_;
  std::int64_t tick_ = 0;
  std::mt19937 random_{5};
  std::normal_distribution<double> noise_{0.0, 0.004};
};

TEST(InclusionSession, ARecordedScanGivesPlaceAndResponse) {
  const rt::InclusionParameters truth = inclusion_at(6.0, -4.0, 22.0);
  for (const bool with_law : {false, true}) {
    InclusionTask task = pressed_by_point();
    if (with_law) task.reference = {{}, kOwnLaw, "the law of 'x'"};
    InclusionIdentification identification(task, session_rig(hal::RigKind::kReplay));
    MadePresses hand(identification, &truth);
    hand.grid();
    const auto model = value_of(identification.finish());
    EXPECT_TRUE(model.converged) << "law " << with_law;
    const auto& found = std::get<rt::InclusionModel>(model.content);
    EXPECT_LT(rt::norm(rt::across(found.place_mm - truth.place_mm, {0.0, 0.0, 1.0})), 1.5)
        << "law " << with_law;
    EXPECT_NEAR(parameter(model, "depth_mm").value, 22.0, 2.5) << "law " << with_law;
    EXPECT_NEAR(model.validity.max_displacement_mm, 11.0, 1.0);
    EXPECT_GT(model.validity.max_force_n, 2.0);
    EXPECT_NE(model.procedure.find(with_law ? "the law of 'x'" : "far from it"), std::string::npos)
        << model.procedure;
    EXPECT_FALSE(rt::check(model));
  }
}

TEST(InclusionSession, WhereItsDepthIsKnownPressesOverItAreEnough) {
  const rt::InclusionParameters truth = inclusion_at(0.0, 0.0, 25.0);
  InclusionTask task = pressed_by_point();
  task.known_depth_mm = 25.0;
  task.reference = {{}, kOwnLaw, "the law of 'x'"};
  InclusionIdentification identification(task, session_rig(hal::RigKind::kReplay));
  MadePresses hand(identification, &truth);
  for (int i = 0; i < 4; ++i) hand.press(0.0, 0.0);
  const auto model = value_of(identification.finish());
  const auto& found = std::get<rt::InclusionModel>(model.content);
  EXPECT_NEAR(found.place_mm.z, -25.0, 1.0);
  EXPECT_NEAR(rt::hunt_crossley_force_n(found.response, 8.0, 0.0) /
                  rt::hunt_crossley_force_n(truth.response, 8.0, 0.0),
              1.0, 0.1);
}

TEST(InclusionSession, RefusesPressesThatTellNoInclusionAndSaysWhy) {
  const rt::InclusionParameters in_the_middle = inclusion_at(0.0, 0.0, 22.0);
  const rt::InclusionParameters outside = inclusion_at(26.0, 0.0, 22.0);  // of what is pressed
  InclusionTask of_known_depth = pressed_by_point();
  of_known_depth.known_depth_mm = 22.0;
  of_known_depth.reference = {{}, kOwnLaw, "the law of 'x'"};
  struct Case {
    const char* what;
    const char* remedy;
    const rt::InclusionParameters* inclusion;
    std::function<void(MadePresses&)> pressed;
    InclusionTask task = pressed_by_point();
  };
  const auto by_grid = [](MadePresses& hand) { hand.grid(); };
  for (const Case& c : {Case{"too few presses", "", &in_the_middle,
                             [](MadePresses& hand) {
                               for (const double x : {-8.0, 0.0, 8.0}) hand.press(x, 0.0);
                               hand.press(0.0, 8.0, 1.0);  // a touch, no press
                             }},
                        Case{"at one place", "known", &in_the_middle,
                             [](MadePresses& hand) {
                               for (int i = 0; i < 12; ++i) hand.press(0.3 * i, 0.0);
                             }},
                        Case{"not straight over", "", &in_the_middle, by_grid, of_known_depth},
                        Case{"never fell to zero", "bias", nullptr,
                             [](MadePresses& hand) {
                               hand.zero_n = 0.5;
                               hand.grid();
                             }},
                        Case{"no inclusion is seen", "", nullptr, by_grid}}) {
    InclusionIdentification identification(c.task, session_rig(hal::RigKind::kReplay));
    MadePresses hand(identification, c.inclusion);
    c.pressed(hand);
    const hal::Error refusal = refusal_of(identification);
    EXPECT_TRUE(holds(refusal.what, c.what));
    EXPECT_TRUE(holds(refusal.remedy, c.remedy));
    EXPECT_FALSE(refusal.remedy.empty()) << c.what;
    EXPECT_FALSE(identification.progress().converged) << c.what;
    EXPECT_FALSE(identification.progress().missing.empty()) << c.what;
    if (refusal.what == "too few presses") {
      EXPECT_EQ(refusal.value, "3");
    }
  }
  InclusionIdentification on_one_side(pressed_by_point(), session_rig(hal::RigKind::kReplay));
  MadePresses hand(on_one_side, &outside);
  for (const double x : {-16.0, -8.0, 0.0, 8.0, 16.0})
    for (const double y : {-16.0, -8.0, 0.0, 8.0, 16.0}) hand.press(x, y);
  EXPECT_FALSE(on_one_side.progress().converged);
  EXPECT_FALSE(on_one_side.progress().missing.empty());
}

TEST(InclusionSession, APersonIsGuidedOverTheSurfaceUntilItIsFound) {
  const rt::InclusionParameters truth = inclusion_at(6.0, -4.0, 22.0);
  InclusionTask task = pressed_by_point();
  task.reach_mm = 16.0;
  task.reference = {{}, kOwnLaw, "the law of 'x'"};
  InclusionIdentification identification(task, session_rig(hal::RigKind::kSimulated));
  MadePresses hand(identification, &truth);
  MotionRequest first = identification.next_request();
  EXPECT_EQ(first.motion, MotionRequest::Motion::kPress);
  EXPECT_NE(first.words.find("in the middle"), std::string::npos) << first.words;
  double completion = 0.0;
  int presses = 0;
  while (presses < 60) {
    const IdentificationProgress progress = identification.progress();
    EXPECT_GE(progress.completion, completion);
    completion = progress.completion;
    if (progress.converged) break;
    EXPECT_FALSE(progress.missing.empty());
    const MotionRequest request = identification.next_request();
    ASSERT_EQ(request.motion, MotionRequest::Motion::kPress);
    EXPECT_GT(request.displacement_mm, 0.0);
    hand.press(request.place_mm.x, request.place_mm.y, request.displacement_mm);
    ++presses;
  }
  const IdentificationProgress progress = identification.progress();
  EXPECT_TRUE(progress.converged);
  EXPECT_GE(presses, 13);  // all places within 16 mm
  ASSERT_EQ(progress.coverage.size(), 1U);
  EXPECT_EQ(progress.coverage.front().share, 1.0);
  EXPECT_EQ(progress.coverage.front().x.bins, 5);
  EXPECT_TRUE(progress.missing.empty());
  EXPECT_NEAR(parameter(progress.parameters, "place_x_mm").value, truth.place_mm.x, 2.0);
}

}  // namespace
}  // namespace hapticd::identification
