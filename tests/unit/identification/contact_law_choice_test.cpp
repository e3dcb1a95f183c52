#include "server/identification/estimate/contact/contact_law_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "identified.h"
#include "real_recording.h"
#include "server/identification/session/contact/contact_identification.h"
#include "tests/reference/creep_force.h"

namespace hapticd::identification {
namespace {

using namespace test;

constexpr double kStepS = 1e-2;

/// Presses of two speeds and depths with a hold each, on an object that gives `displacement_mm(force_n, i)`.
template <class Object>
CreepFit palpation_of(Object object, double noise_n) {
  CreepFit fit(rt::CreepParameters{}.time_s, 1);
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, noise_n);
  double last_mm = 0.0;
  for (int i = 0; i < 4000; ++i) {
    const double t = kStepS * i;
    const double phase = std::fmod(t, 8.0);
    const double peak_n = t < 16.0 ? 6.0 : 4.0;
    const double rise_s = t < 8.0 ? 2.0 : 0.5;
    const double force_n = phase < rise_s ? peak_n * phase / rise_s
                                          : (phase < 4.0 ? peak_n : std::max(0.0, peak_n * (5.0 - phase)));
    PalpationSample s;
    s.time_s = t;
    s.displacement_mm = object(force_n);
    s.rate_mm_per_s = (s.displacement_mm - last_mm) / kStepS;
    last_mm = s.displacement_mm;
    s.in_contact = force_n > 0.0;
    s.normal_force_n = force_n + noise(random);
    fit.add(s, kStepS);
  }
  return fit;
}

ContactLawChoice chosen(const CreepFit& fit) {
  const auto choice = choose_contact_law(fit, 0.0, 0.0, 80);
  EXPECT_TRUE(choice.has_value());
  return choice.value_or(ContactLawChoice{});
}

/// Displacement of a sponge: soft at first, then its cells collapse, then it is dense.
double sponge_mm(double force_n) {
  return 12.0 * std::pow(force_n / 6.0, 1.2) / (0.15 + std::pow(force_n / 6.0, 1.2));
}

rt::CreepParameters creeping() {
  rt::CreepParameters law{.weight = {0.5, 0.1, 0.15, 0.15, 0.1}, .max_force_n = 6.0};
  for (std::size_t j = 0; j < rt::CreepParameters::kKnots; ++j) {
    const double share = static_cast<double>(j) / (rt::CreepParameters::kKnots - 1);
    law.displacement_mm[j] = 12.0 * std::pow(share, 1.1);
  }
  return law;
}

TEST(ContactLawChoice, KeepsThePowerLawWhereItHolds) {
  const auto choice = chosen(palpation_of([](double f) { return std::pow(f / 0.3, 1.0 / 1.5); }, 0.01));
  EXPECT_EQ(choice.form, ContactLawForm::kPower);
  EXPECT_LT(choice.power.relative, 0.02);
  EXPECT_FALSE(choice.power_is_unfit());
}

TEST(ContactLawChoice, TakesACurveWhereNoPowerFitsAndNoCreepWithoutNeed) {
  const auto choice = chosen(palpation_of(sponge_mm, 0.005));
  EXPECT_EQ(choice.form, ContactLawForm::kElasticCurve);
  EXPECT_LT(choice.elastic_curve.relative, 0.02);
  EXPECT_GT(choice.power.relative, 2.0 * choice.elastic_curve.relative);
}

TEST(ContactLawChoice, TakesCreepWhereTheObjectCreeps) {
  rt::CreepLaw law(creeping(), 1.0 / kStepS);
  const auto choice = chosen(palpation_of([&](double f) { return law.update(f).displacement_mm; }, 0.005));
  EXPECT_EQ(choice.form, ContactLawForm::kCreep);
  EXPECT_LT(choice.creep.relative, 0.5 * choice.elastic_curve.relative);
  EXPECT_GT(choice.creep.relative, 0.0);
}

TEST(ContactLawChoice, TellsAPowerLawThatIsNoLawToRenderWith) {
  ContactLawChoice choice;
  choice.form = ContactLawForm::kElasticCurve;
  choice.power.relative = 0.3;
  EXPECT_TRUE(choice.power_is_unfit());
  choice.power.relative = 0.2;
  EXPECT_FALSE(choice.power_is_unfit());
  choice.form = ContactLawForm::kPower;
  choice.power.relative = 0.3;
  EXPECT_FALSE(choice.power_is_unfit()) << "nothing is better";
}

TEST(ContactLawChoice, HasNothingToChooseFromTooFewSamples) {
  CreepFit fit(rt::CreepParameters{}.time_s, 1);
  EXPECT_FALSE(choose_contact_law(fit, 0.0, 0.0, 80));
  for (int i = 0; i < 50; ++i) fit.add({0.1 * i, 1.0, 0.1 * i, true, kStepS * i}, kStepS);
  EXPECT_FALSE(choose_contact_law(fit, 0.0, 0.0, 80));
}

TEST(HeldOutBlocks, EverySampleIsHeldOutInOneFoldAndNeighboursTogether) {
  constexpr std::size_t kCount = 1000;
  for (std::size_t i = 0; i < kCount; ++i) {
    int folds = 0;
    for (HeldOutBlocks blocks{0}; blocks.fold < HeldOutBlocks::kFolds; ++blocks.fold) {
      folds += blocks.contains(i, kCount) ? 1 : 0;
    }
    ASSERT_EQ(folds, 1);
    ASSERT_FALSE(HeldOutBlocks{}.contains(i, kCount));
  }
  for (std::size_t i = 0; i < 50; ++i) ASSERT_TRUE(HeldOutBlocks{0}.contains(i, kCount));
  for (std::size_t i = 50; i < 100; ++i) ASSERT_TRUE(HeldOutBlocks{1}.contains(i, kCount));
}

TEST(ContactLawChoice, ACompressedElastomerGetsACurveThatItsWholeLoadingObeys) {
  const auto path = real_recording("ecoflex_compression/EF30_50T_A1.csv");
  if (path.empty()) GTEST_SKIP() << "HAPTICD_RECORDINGS has no such recording";
  replay::RecordingColumns columns;
  columns.position.column = "compression_mm";
  const auto recording = value_of(replay::load_recording(path.string(), columns));
  ContactIdentification identification(ContactTask{}, recording_rig(1.0 / recording.median_step_s));
  play(identification, recording);
  const auto model = value_of(identification.finish());
  const auto& curve = std::get<rt::ContactModel>(model.content).creep;
  ASSERT_TRUE(curve);
  EXPECT_NE(model.procedure.find("chosen: "), std::string::npos) << model.procedure;
  EXPECT_EQ(model.procedure.find("chosen: power law"), std::string::npos) << model.procedure;
  const double surface_mm = parameter(model, "curve_surface_mm").value;
  EXPECT_NEAR(model.validity.max_displacement_mm, 20.0 - surface_mm, 0.1);
  CreepForce inverse(curve->parameters);
  double left = 0.0, whole = 0.0;
  for (std::size_t i = 0; i < recording.time_s.size(); ++i) {
    const double force_n = inverse.update(recording.depth_mm[i] - surface_mm, recording.median_step_s);
    left += std::pow(force_n - recording.force_n[i], 2);
    whole += std::pow(recording.force_n[i], 2);
  }
  EXPECT_LT(std::sqrt(left / whole), 0.02);
}

}  // namespace
}  // namespace hapticd::identification
