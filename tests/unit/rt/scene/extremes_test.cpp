#include <gtest/gtest.h>

#include <functional>

#include "explore_bench.h"
#include "rt/baseline/published_direction.h"
#include "rt/control/hand_port_passivity.h"
#include "rt/deformation/creep_law.h"
#include "rt/deformation/fused_displacement.h"
#include "rt/deformation/hunt_crossley.h"
#include "rt/deformation/tracked_direction.h"
#include "rt/signal/structural_deflection.h"
#include "rt/target/target_blend.h"
#include "tests/unit/rt/deformation/stroked_surface.h"

namespace hapticd::rt {
namespace {

using namespace test;

constexpr hal::Vector3 kUp{0.0, 0.0, 1.0};
constexpr hal::Vector3 kHeld{0.0, 0.0, -4.0};

/// What a scene did over some ticks.
class Watch {
 public:
  explicit Watch(const ExploreBench& bench)
      : limit_n_(bench.scene().guard.max_force_n),
        change_n_(1e-3 * bench.scene().guard.max_force_rate_n_per_s) {}

  void see(const TickRecord& record) {
    const hal::Vector3& f = record.device_command_n;
    ASSERT_TRUE(finite(f)) << "tick " << record.tick;
    ASSERT_LE(norm(f), limit_n_ + 1e-9) << "tick " << record.tick;
    if (seen_ && record.guard_state != GuardState::kLatched) {
      ASSERT_LE(norm(f - force_n_), change_n_ + 1e-9) << "tick " << record.tick;
    }
    force_n_ = f;
    ASSERT_TRUE(std::isfinite(record.displacement_mm)) << "tick " << record.tick;
    ASSERT_TRUE(std::isfinite(record.hand_energy_mj)) << "tick " << record.tick;
    if (record.in_contact) {
      ASSERT_NEAR(norm(record.normal), 1.0, 1e-9) << "tick " << record.tick;
    } else {
      ++ticks_free;
    }
    if (seen_ && record.in_contact && last.in_contact) {
      max_turned_rad = std::max(max_turned_rad, angle_rad(record.normal, first_.normal));
      max_drifted_mm = std::max(max_drifted_mm, std::abs(record.displacement_mm - first_.displacement_mm));
      max_command_change_n =
          std::max(max_command_change_n, norm(record.device_command_n - first_.device_command_n));
    }
    if (!seen_) first_ = record;
    seen_ = true;
    last = record;
  }
  int ticks_free = 0;
  double max_turned_rad = 0.0;  ///< and the like: against the first record seen, in contact
  double max_drifted_mm = 0.0;
  double max_command_change_n = 0.0;
  TickRecord last;

 private:
  double limit_n_, change_n_;
  hal::Vector3 force_n_;
  TickRecord first_;
  bool seen_ = false;
};

/// A minute of holding with each encoder between two counts of 0.03 mm, changing at a tick with probability
/// `flips`.
Watch dither(ExploreBench& bench, double flips) {
  bench.press_and_hold();
  bench.rest(kHeld, 10'000);
  std::mt19937_64 random(70);
  std::bernoulli_distribution flip(flips);
  hal::Vector3 off;
  Watch watch(bench);
  for (int i = 0; i < 60'000; ++i) {
    for (double* axis : {&off.x, &off.y, &off.z}) {
      if (flip(random)) *axis = 0.03 - *axis;
    }
    hal::RigSample sample = bench.at(kHeld);
    sample.tip_position_mm = kHeld + off;
    sample.sensor_force_n = bench.sensed_n(kUp * 1.6 + random_vector(random, 0.003));
    watch.see(bench.tick(sample));
  }
  return watch;
}

// -- what every scene must bear
// ------------------------------------------------------------------------------

struct Extreme {
  const char* name;
  std::function<void(SceneSpec&)> change;
  std::function<void(ExploreBench&)> run;
};

void none(SceneSpec&) {}

const std::vector<Extreme>& extremes() {
  static const std::vector<Extreme> all{
      {"HeldForThreeMinutes", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         bench.rest(kHeld, 10'000);  // the law's own creep
         Watch watch(bench);
         for (int i = 0; i < 180'000; ++i) watch.see(bench.tick(bench.at(kHeld)));
         EXPECT_EQ(watch.ticks_free, 0);
         EXPECT_LT(watch.max_turned_rad, 0.1 * kDegree);
         EXPECT_LT(watch.max_drifted_mm, 0.25) << "towards the law, which is 5 % off at the most";
       }},
      {"TouchedWithNextToNothing", none,
       [](ExploreBench& bench) {
         bench.rest({0.0, 0.0, 10.0}, 300);
         bench.move({0.0, 0.0, 10.0}, {0.0, 0.0, -0.2}, 1000);  // 80 mN
         Watch watch(bench);
         for (int i = 0; i < 60'000; ++i) {
           watch.see(bench.tick(bench.at({0.0, 0.0, -0.2 + 0.19 * std::sin(1e-3 * i)})));  // 4 … 156 mN
         }
         EXPECT_LT(norm(watch.last.device_command_n), 0.5);
       }},
      {"ForceVanishesWhileTheTipIsDeep", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         Watch watch(bench);
         for (int i = 0; i < 3000; ++i) {
           hal::RigSample sample = bench.at(kHeld);
           sample.sensor_force_n = bench.sensed_n(kUp * (1.6 * std::exp(-0.01 * i)));
           watch.see(bench.tick(sample));
         }
         EXPECT_FALSE(watch.last.in_contact);
         EXPECT_LT(norm(watch.last.device_command_n), 1e-9);
       }},
      {"OnlyTangentialForceIsLeft", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         Watch watch(bench);
         for (int i = 0; i < 5000; ++i) {
           hal::RigSample sample = bench.at(kHeld);
           sample.sensor_force_n = bench.sensed_n({1.0, 0.0, 0.0});
           watch.see(bench.tick(sample));
         }
       }},
      {"TargetOfNothing", [](SceneSpec& s) { s.target = linear_target(0.0); },
       [](ExploreBench& bench) {
         const TickRecord record = bench.press_and_hold();
         EXPECT_NEAR(record.device_command_n.z, -1.6, 0.02) << "the device takes the object away";
         Watch watch(bench);
         for (int i = 0; i < 20'000; ++i) watch.see(bench.tick(bench.at(kHeld)));
       }},
      {"TargetAHundredTimesTheObject", [](SceneSpec& s) { s.target = linear_target(100.0 * kObjectNPerMm); },
       [](ExploreBench& bench) {
         bench.press_and_hold();
         Watch watch(bench);
         for (int i = 0; i < 20'000; ++i) watch.see(bench.tick(bench.at(kHeld)));
         EXPECT_NEAR(norm(watch.last.device_command_n), bench.scene().guard.max_force_n, 1e-6)
             << "all the device has";
         EXPECT_TRUE(watch.last.guard_limits & guard_limit::kForce);
         bench.move(kHeld, {0.0, 0.0, 10.0}, 500);
         EXPECT_LT(norm(bench.rest({0.0, 0.0, 10.0}, 1000).device_command_n), 1e-9) << "nothing was wound up";
       }},
      {"DitheringBetweenTwoCounts", none,
       [](ExploreBench& bench) {
         const Watch watch = dither(bench, 0.1);
         EXPECT_EQ(watch.ticks_free, 0);
         // Each axis changes every 10 ms on the average: to a filter that is some motion, 0.03 mm across a
         // presliding way of 0.1-0.3 mm. Recursion (4.21) has nothing that calls it back.
         const ExploreParameters& explore = bench.scene().explore;
         const bool recursive = explore.displacement == DisplacementEstimator::kRecursive;
         EXPECT_LT(watch.max_turned_rad,
                   (explore.direction == DirectionMethod::kTracked ? 3.0 : 5.0) * kDegree);
         EXPECT_LT(watch.max_drifted_mm, recursive ? 1.0 : 0.1);
       }},
      {"GapsOfFiveMilliseconds", none,
       [](ExploreBench& bench) {
         bench.rest({0.0, 0.0, 10.0}, 300);
         Watch watch(bench);
         for (int i = 1; i <= 1000; ++i) {
           if (i % 37 == 0) bench.set_time_ns(bench.time_ns() + 5'000'000);
           const double share = 1e-3 * i;
           watch.see(bench.tick(bench.at({0.0, 0.0, 10.0 - 14.0 * share * share * (3.0 - 2.0 * share)})));
         }
         EXPECT_EQ(watch.last.contact_count, 1U);
         EXPECT_NEAR(bench.rest(kHeld, 500).displacement_mm, 4.0, 0.5);
       }},
      {"JitteredPeriod", none,
       [](ExploreBench& bench) {
         std::mt19937_64 random(71);
         std::uniform_int_distribution<std::int64_t> period(700'000, 1'300'000);
         bench.rest({0.0, 0.0, 10.0}, 300);
         Watch watch(bench);
         const std::int64_t begin_ns = bench.time_ns();
         while (bench.time_ns() - begin_ns < 1'000'000'000) {
           bench.set_period_ns(period(random));
           const double share = 1e-9 * static_cast<double>(bench.time_ns() - begin_ns);
           watch.see(bench.tick(bench.at({0.0, 0.0, 10.0 - 14.0 * share * share * (3.0 - 2.0 * share)})));
         }
         EXPECT_EQ(watch.last.contact_count, 1U);
         for (int i = 0; i < 5000; ++i) {
           bench.set_period_ns(period(random));
           watch.see(bench.tick(bench.at(kHeld)));
         }
         EXPECT_NEAR(watch.last.displacement_mm, 4.0, 0.5);
         EXPECT_EQ(watch.last.contact_count, 1U);
       }},
      {"NotANumberInContact", none,
       [](ExploreBench& bench) {
         ASSERT_GT(bench.press_and_hold().device_command_n.z, 0.3);
         hal::RigSample bad = bench.at(kHeld);
         bad.sensor_force_n.y = std::nan("");
         const TickRecord record = bench.tick(bad);
         EXPECT_EQ(norm(record.device_command_n), 0.0);
         EXPECT_EQ(record.guard_fault, GuardFault::kNonFinite);
         bench.rest(kHeld, 10);
         ASSERT_TRUE(bench.renderer().clear());
         EXPECT_EQ(norm(bench.rest(kHeld, 1000).device_command_n), 0.0) << "not resumed in the middle";
         bench.move(kHeld, {0.0, 0.0, 10.0}, 500);
         bench.rest({0.0, 0.0, 10.0}, 10'000);
         EXPECT_GT(bench.press_and_hold().device_command_n.z, 0.3);
       }},
      {"SaturatedInContact", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         hal::RigSample bad = bench.at(kHeld);
         bad.status = hal::sample_status::kForceSaturated;
         EXPECT_EQ(bench.tick(bad).guard_fault, GuardFault::kSensorSaturated);
         EXPECT_EQ(norm(bench.rest(kHeld, 100).device_command_n), 0.0);
       }},
      {"ReversedNormal", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         Watch watch(bench);
         for (int i = 0; i < 5000; ++i) {
           hal::RigSample sample = bench.at(kHeld);
           sample.sensor_force_n = bench.sensed_n(kUp * ((i / 50) % 2 == 0 ? -1.6 : 1.6));
           watch.see(bench.tick(sample));
         }
         bench.rest({0.0, 0.0, 10.0}, 15'000);
         const TickRecord record = bench.press_and_hold();
         EXPECT_LT(angle_rad(record.normal, kUp), 0.5 * kDegree) << "the next contact knows nothing of it";
       }},
      {"RidgeOfNinetyDegrees", none,
       [](ExploreBench& bench) {
         // Along a plane, over an edge, down the side: the reaction turns within a tick.
         bench.press_and_hold();
         Watch watch(bench);
         StrokedSurface friction({0.3, 0.3, 0.0});
         hal::Vector3 tip = kHeld;
         const auto slide = [&](const hal::Vector3& step, const hal::Vector3& normal, int ticks) {
           for (int i = 0; i < ticks; ++i) {
             tip = tip + step;
             hal::RigSample sample = bench.at(tip);
             sample.sensor_force_n = bench.sensed_n(friction.move(step, normal, 1.6));
             watch.see(bench.tick(sample));
           }
         };
         slide({0.03, 0.0, 0.0}, kUp, 500);
         slide({0.0, 0.0, -0.03}, {1.0, 0.0, 0.0}, 1000);
         if (bench.scene().tip == Tip::kRod) {
           EXPECT_LT(angle_rad(watch.last.normal, {1.0, 0.0, 0.0}), 10.0 * kDegree) << "30 mm later";
         }
       }},
      {"StickSlip", none,
       [](ExploreBench& bench) {
         // A gel: the tip sticks while the tangential force grows to 0.9 f_n, then jumps by a millimetre.
         bench.press_and_hold();
         Watch watch(bench);
         hal::Vector3 tip = kHeld;
         double angle_sum = 0.0;
         constexpr int kTicks = 20'000;
         for (int i = 0; i < kTicks; ++i) {
           const int phase = i % 60;
           if (phase >= 55) tip.x += 0.2;
           const double pull = phase < 55 ? 0.9 * phase / 55.0 : 0.9 * (60 - phase) / 5.0;
           hal::RigSample sample = bench.at(tip);
           sample.sensor_force_n = bench.sensed_n({-1.6 * pull, 0.0, 1.6});
           watch.see(bench.tick(sample));
           angle_sum += angle_rad(watch.last.normal, kUp);
         }
         EXPECT_LT(angle_sum / kTicks, 42.0 * kDegree) << "no farther than the reaction itself leans";
       }},
      {"TenMinutesOfEverything", none,
       [](ExploreBench& bench) {
         bench.press_and_hold();
         Watch watch(bench);
         for (int i = 0; i < 600'000; ++i) {
           const double t = 1e-3 * i;
           watch.see(bench.tick(bench.at(
               {15.0 * std::sin(0.9 * t), 10.0 * std::sin(0.7 * t), 1.0 - 4.0 * std::cos(1.3 * t)})));
         }
         EXPECT_GT(watch.last.contact_count, 50U);
         bench.rest({0.0, 0.0, 10.0}, 15'000);
         const TickRecord after = bench.press_and_hold();
         EXPECT_NEAR(after.displacement_mm, 4.0, 0.4);
         EXPECT_LT(angle_rad(after.normal, kUp), 0.5 * kDegree);
       }},
  };
  return all;
}

class SceneExtremes : public testing::TestWithParam<std::tuple<std::size_t, std::size_t>> {};

TEST_P(SceneExtremes, AreBorne) {
  SceneSpec spec = all_explore_scenes()[std::get<0>(GetParam())];
  spec.structural_compensation = false;
  spec.target = linear_target(0.7);
  const Extreme& extreme = extremes()[std::get<1>(GetParam())];
  extreme.change(spec);
  ExploreBench bench(spec);
  extreme.run(bench);
}

std::string name_of(const testing::TestParamInfo<std::tuple<std::size_t, std::size_t>>& test) {
  const SceneSpec spec = all_explore_scenes()[std::get<0>(test.param)];
  const bool published = spec.contact.method == ContactMethod::kFilteredAcceleration;
  return spec.name + (published ? "_as_published_" : "_") + extremes()[std::get<1>(test.param)].name;
}
INSTANTIATE_TEST_SUITE_P(All, SceneExtremes,
                         testing::Combine(testing::Range<std::size_t>(0, 7),
                                          testing::Range<std::size_t>(0, extremes().size())),
                         name_of);

// -- laws at the ends of their ranges
// ------------------------------------------------------------------------

/// Pressed onto an object that is exactly a Hunt-Crossley law, down to where it gives 2 N, or 60 mm; returns
/// the estimate and the truth.
std::pair<TickRecord, double> press_onto(const HuntCrossleyParameters& law, DisplacementEstimator estimator) {
  ObjectModel model = bench_model();
  model.hunt_crossley = IdentifiedLaw<HuntCrossleyParameters>{law, 0.05};
  SceneSpec spec = explore_scene(Tip::kRod);
  spec.structural_compensation = false;
  spec.contact.evidence.lowest_stiffness_n_per_mm = 0.002;  // softer than anything a scene is made for
  spec.explore.law = ContactLawKind::kHuntCrossley;
  spec.explore.displacement = estimator;
  ExploreBench bench(spec, model);
  bench.rest({0.0, 0.0, 10.0}, 300);
  const double deepest = std::min(60.0, std::pow(2.0 / law.stiffness_n_per_mm_m, 1.0 / law.exponent));
  Watch watch(bench);
  double x = 0.0;
  for (int i = 1; i <= 4000; ++i) {
    x = deepest * 0.5 * (1.0 - std::cos(std::numbers::pi * std::min(1.0, i / 3000.0)));
    hal::RigSample sample = bench.at({0.0, 0.0, 10.0});
    sample.tip_position_mm = {0.0, 0.0, -x};
    sample.sensor_force_n = bench.sensed_n(kUp * hunt_crossley_force_n(law, x, 0.0));
    watch.see(bench.tick(sample));
  }
  return {watch.last, x};
}

class LawExtremes : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(LawExtremes, ASceneWithTheExactLawFindsTheDisplacement) {
  const HuntCrossleyParameters law{std::get<1>(GetParam()), 0.0, std::get<0>(GetParam())};
  for (const auto estimator : {DisplacementEstimator::kFused, DisplacementEstimator::kInverse}) {
    const auto [record, x] = press_onto(law, estimator);
    const bool hardly_an_object = hunt_crossley_force_n(law, x, 0.0) < 0.2;
    if (hardly_an_object) continue;
    ASSERT_TRUE(record.in_contact);
    // Way is counted from where force was first seen; a soft object is deep by then.
    const double unseen_mm = estimator == DisplacementEstimator::kFused
                                 ? hunt_crossley_displacement(law, 0.02, 0.0).displacement_mm
                                 : 0.0;
    EXPECT_NEAR(record.displacement_mm, x, 0.01 * x + 0.05 + unseen_mm);
  }
}

INSTANTIATE_TEST_SUITE_P(All, LawExtremes,
                         testing::Combine(testing::Values(1.0, 1.5, 2.0, 2.5, 3.0),
                                          testing::Values(1e-4, 1e-2, 1.0, 30.0, 1e3)));

// The sponge of D§3: 16 mm at 2 N. At the threshold of 20 mN the tip is 1.8 mm deep, and looking back finds
// no force below it: the onset is known no better than the law says.
TEST(OnsetExtremes, ASpongeIsNotTakenForShallowerThanItsLawSays) {
  const HuntCrossleyParameters sponge{0.0059, 0.0, 2.1};
  const auto [inverse, x] = press_onto(sponge, DisplacementEstimator::kInverse);
  EXPECT_NEAR(inverse.displacement_mm / x, 1.0, 0.005);
  const auto [fused, same_x] = press_onto(sponge, DisplacementEstimator::kFused);
  EXPECT_NEAR(fused.displacement_mm / same_x, 1.0, 0.05);
}

// -- stages, for as long as it takes
// -------------------------------------------------------------------------

constexpr long kTenHours = 36'000'000;

TEST(TenHours, OfDahlsFriction) {
  double z = 0.0;
  for (long i = 0; i < kTenHours; ++i) z = dahl_step(z, i % 2 == 0 ? 0.03 : -0.03, 0.3);
  EXPECT_LT(std::abs(z), 0.06) << "dithering between two counts leads nowhere";
}

TEST(TenHours, OfStructuralDeflection) {
  StructuralDeflection deflection(3.5, 10.0, 1000.0);
  hal::Vector3 bent;
  for (long i = 0; i < kTenHours; ++i) bent = deflection.update({3.5, 0.0, i % 2 == 0 ? 7.0 : 0.0});
  EXPECT_NEAR(bent.x, 1.0, 1e-9);
  EXPECT_NEAR(bent.z, 1.0, 0.05);
}

TEST(TenHours, OfTheHandsPort) {
  HandPortPassivity port(1000.0);
  port.begin();
  for (long i = 0; i < kTenHours; ++i) {
    // A spring of 1 N/mm between two counts, its force the mean over the way.
    const double step = i % 2 == 0 ? -0.03 : 0.03;
    port.update(kUp * 1.0, {}, kUp * step, kUp * (1000.0 * step));
  }
  EXPECT_NEAR(port.energy_mj(), 0.0, 1e-6);
  EXPECT_EQ(port.damping_n_s_per_mm(), 0.0);
}

TEST(TenHours, OfTheFusedDisplacement) {
  FusedDisplacement fused(0.05, 0.003, 1000.0);
  fused.begin(4.0, 0.03);
  for (long i = 0; i < kTenHours; ++i) {
    fused.update(i % 2 == 0 ? 0.03 : -0.03, 0.0, {4.05, 2.0});
  }
  EXPECT_NEAR(fused.displacement_mm(), 4.0, 0.1);
  EXPECT_GE(fused.deviation_mm(), 0.0);
}

TEST(TenHours, OfCreep) {
  const CreepParameters parameters = bench_model().creep->parameters;
  CreepLaw law(parameters, 1000.0);
  LawEstimate now;
  for (long i = 0; i < kTenHours / 4; ++i) now = law.update(1.6);
  EXPECT_NEAR(now.displacement_mm, law.curve(1.6).displacement_mm, 1e-9);
}

TEST(TenHours, OfOneTarget) {
  TargetBlend blend(linear_target(0.7), 1000.0);
  double force = 0.0;
  for (long i = 0; i < kTenHours; ++i) force = blend.update(2.0, 0.0, {});
  EXPECT_DOUBLE_EQ(force, 1.4);
}

// -- directions at rest and in the ways friction can mislead
// -------------------------------------------------

struct Dithered {
  double largest_rad = 0.0, end_rad = 0.0;
};
/// A minute at rest, the encoder of one axis across the normal passing to the other count and back.
Dithered dithered(const FrictionParameters& friction, int every_ticks) {
  std::mt19937_64 random(72);
  TrackedDirection direction(friction, 0.003, 1000.0);
  direction.begin(kUp);
  bool beyond = false;
  Dithered seen;
  for (int i = 0; i < 60'000; ++i) {
    hal::Vector3 step;
    if (i > 500 && i % every_ticks == 0) {
      step.x = beyond ? -0.03 : 0.03;
      beyond = !beyond;
    }
    // The adaptive window calls no single count a velocity.
    direction.update(kUp + random_vector(random, 0.003), step, {});
    seen.end_rad = angle_rad(direction.normal(), kUp);
    if (i > 500) seen.largest_rad = std::max(seen.largest_rad, seen.end_rad);
  }
  return seen;
}
const std::vector<FrictionParameters> kTips{{0.3, 0.3, 0.0}, {0.6, 0.1, 0.0}, kBallBearingFriction};

TEST(DirectionExtremes, DitheringForAMinuteTurnsTheNormalNoMoreThanOneCountDoes) {
  for (const FrictionParameters& friction : kTips) {
    const double one_count = friction.kinetic * (1.0 - std::exp(-0.03 / friction.presliding_mm));
    for (const int every : {1, 2, 10, 100, 1000}) {
      const Dithered seen = dithered(friction, every);
      EXPECT_LT(seen.largest_rad, 1.4 * one_count + 0.5 * kDegree) << friction.kinetic << ", " << every;
      EXPECT_LT(seen.end_rad, 1.4 * one_count + 0.5 * kDegree) << friction.kinetic << ", " << every;
    }
  }
}

TEST(DirectionExtremes, ATipThatDithersTurnsNoTrackedNormal) {
  for (const FrictionParameters& friction : kTips) {
    EXPECT_LT(dithered(friction, 1000).largest_rad, 1.0 * kDegree) << friction.kinetic;
  }
}

}  // namespace
}  // namespace hapticd::rt
