#include "server/identification/session/contact/contact_identification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "contact_synthetic.h"
#include "identified.h"
#include "real_recording.h"
#include "server/identification/gate/palpation_tracker.h"
#include "server/identification/gate/sample_gate.h"
#include "server/identification/session/contact/contact_requests.h"
#include "server/identification/session/contact/coverage_map.h"

namespace hapticd::identification {
namespace {

using namespace test;

constexpr rt::HuntCrossleyParameters kLaw{0.25, 4e-4, 1.6};
constexpr double kDepthMm = 7.0;
/// Depth at which this law's force has reached what shows a contact from noise: half the threshold, 10 mN.
const double kLateMm = std::pow(0.010 / kLaw.stiffness_n_per_mm_m, 1.0 / kLaw.exponent);

hal::RigInfo rig(hal::RigKind kind = hal::RigKind::kHardware, double rate_hz = 1000.0) {
  hal::RigInfo info;
  info.kind = kind;
  info.rate_hz = rate_hz;
  if (kind != hal::RigKind::kReplay) {
    info.device.position_resolution_mm = 0.007;
    info.sensor.range_n = 35.0;
  }
  return info;
}

ContactTask hunt_crossley_task() {
  return {.law = rt::ContactLawKind::kHuntCrossley};
}

void feed(Identification& identification, const std::vector<rt::Observation>& observations) {
  for (const rt::Observation& o : observations) identification.add(o);
}

TEST(ContactIdentification, FindsALawWithItsErrorsByEveryMethod) {
  const auto observations = synthetic_observations(kLaw, kDepthMm);
  for (const ContactFitMethod method :
       {ContactFitMethod::kRecursiveThenBatch, ContactFitMethod::kRecursive, ContactFitMethod::kBatch}) {
    ContactTask task = hunt_crossley_task();
    task.method = method;
    ContactIdentification identification(task, rig());
    feed(identification, observations);
    const auto model = value_of(identification.finish());
    const auto& law = std::get<rt::ContactModel>(model.content).hunt_crossley;
    ASSERT_TRUE(law);
    EXPECT_LT(law_displacement_error(kLaw, law->parameters, kDepthMm, kLateMm), 0.03)
        << static_cast<int>(method);
    EXPECT_NEAR(model.validity.max_displacement_mm, kDepthMm - kLateMm, 0.05);
    EXPECT_LT(model.residual, 0.03);
    EXPECT_FALSE(std::get<rt::ContactModel>(model.content).creep);
    for (const rt::EstimatedParameter& p : model.parameters) {
      EXPECT_TRUE(std::isfinite(p.standard_error)) << p.name;
      EXPECT_GT(p.standard_error, 0.0) << p.name;
    }
  }
}

TEST(ContactIdentification, TellsWhatIsMissingUntilItHasConverged) {
  ContactIdentification identification(hunt_crossley_task(), rig());
  EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kPress);
  EXPECT_TRUE(identification.next_request().words.ends_with(" N")) << identification.next_request().words;
  ASSERT_FALSE(identification.progress().missing.empty());
  EXPECT_NE(identification.progress().missing.front().find("(no contact seen yet)"), std::string::npos);
  double before = 0.0;
  bool converged = false;
  std::size_t i = 0;
  for (const rt::Observation& o : synthetic_observations(kLaw, kDepthMm)) {
    identification.add(o);
    if (++i % 200 != 0) continue;
    const IdentificationProgress progress = identification.progress();
    EXPECT_GE(progress.completion, before);
    before = progress.completion;
    EXPECT_EQ(progress.converged, progress.missing.empty());
    EXPECT_LE(progress.fit.size(), 200U);
    converged = converged || progress.converged;
  }
  const IdentificationProgress progress = identification.progress();
  EXPECT_TRUE(converged);
  EXPECT_TRUE(progress.converged) << progress.missing.front();
  EXPECT_EQ(progress.completion, 1.0);
  EXPECT_EQ(progress.coverage.front().share, 1.0);
  EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest);
}

TEST(ContactIdentification, WantsTheDepthItWasAskedFor) {
  ContactTask task = hunt_crossley_task();
  task.displacement_mm = 9.0;
  ContactIdentification identification(task, rig());
  feed(identification, synthetic_observations(kLaw, 6.0));
  EXPECT_FALSE(identification.progress().converged);
  EXPECT_TRUE(holds(identification.progress().missing.front(), "press deeper than 9 mm"));
}

TEST(ContactIdentification, LeavesOutWhatIsUnfitAndSaysSo) {
  ContactIdentification identification(hunt_crossley_task(), rig());
  auto observations = synthetic_observations(kLaw, kDepthMm);
  for (std::size_t i = 700; i < observations.size(); i += 97) {
    observations[i].sample.sensor_force_n.z = std::numeric_limits<double>::quiet_NaN();
  }
  for (std::size_t i = 750; i < observations.size(); i += 501) {
    observations[i].sample.tip_position_mm.z = std::numeric_limits<double>::infinity();
  }
  for (std::size_t i = 3000; i < 3030; ++i) {
    observations[i].sample.status = hal::sample_status::kForceSaturated;
    observations[i].sample.sensor_force_n.z = 1e4;
  }
  observations.erase(observations.begin() + 6000, observations.begin() + 6200);  // a gap
  feed(identification, observations);
  const auto model = value_of(identification.finish());
  EXPECT_LT(law_displacement_error(kLaw, std::get<rt::ContactModel>(model.content).hunt_crossley->parameters,
                                   kDepthMm, kLateMm),
            0.04);
  for (const char* words : {"not a number", "end of range", "gap"}) {
    EXPECT_TRUE(has_remark(identification, words)) << words;
  }
}

TEST(ContactIdentification, RefusesWhatIsNoPalpationAndSaysWhatToDo) {
  const auto good = synthetic_observations(kLaw, kDepthMm, 0.003, 0.0);
  const auto changed = [&](const auto& change) {
    auto observations = good;
    for (rt::Observation& o : observations) change(o.sample);
    return observations;
  };
  struct Case {
    const char* name;
    std::vector<rt::Observation> observations;
    const char* what;
  };
  using hal::RigSample;
  const std::vector<Case> cases{
      {"nothing", {}, "too few usable samples"},
      {"ten samples", {good.begin() + 700, good.begin() + 710}, "too few usable samples"},
      {"all NaN", changed([](RigSample& s) { s.sensor_force_n.z = std::nan(""); }), "too few usable samples"},
      {"constant force", changed([](RigSample& s) { s.sensor_force_n.z = 1.0; }), "the force never changes"},
      {"constant position", changed([](RigSample& s) { s.tip_position_mm.z = 1.0; }),
       "the position never changes"},
      {"reversed force", changed([](RigSample& s) { s.sensor_force_n.z *= -1.0; }),
       "the force has the wrong sign"},
      {"no contact", changed([](RigSample& s) { s.sensor_force_n.z *= 1e-5; }), "no contact"},
      {"metres", changed([](RigSample& s) { s.tip_position_mm.z *= 1e-3; }),
       "a way of the tip that no palpation has"},
      {"micronewtons", changed([](RigSample& s) { s.sensor_force_n.z *= 1e6; }),
       "a stiffness that no object has"}};
  for (const Case& c : cases) {
    for (const hal::RigKind kind : {hal::RigKind::kHardware, hal::RigKind::kReplay}) {
      hal::RigInfo info = rig(kind);
      info.sensor.range_n = 0.0;
      ContactIdentification identification(ContactTask{}, info);
      feed(identification, c.observations);
      const auto model = identification.finish();
      ASSERT_FALSE(model) << c.name;
      EXPECT_EQ(model.error().what.rfind(c.what, 0), 0U) << c.name << ": " << model.error().text();
      EXPECT_FALSE(model.error().remedy.empty()) << c.name;
    }
  }
  ContactIdentification reversed(ContactTask{}, rig(hal::RigKind::kReplay));
  feed(reversed, changed([](RigSample& s) { s.tip_position_mm.z *= -1.0; }));
  ASSERT_FALSE(reversed.finish());
  EXPECT_EQ(reversed.finish().error().what.rfind("the position has the wrong sign", 0), 0U);
}

TEST(ContactIdentification, AFewSamplesThatPullAreNoReversedSensor) {
  auto observations = synthetic_observations(kLaw, kDepthMm, 0.003, 0.0);
  double largest_n = 0.0;
  for (const rt::Observation& o : observations) largest_n = std::max(largest_n, o.sample.sensor_force_n.z);
  for (std::size_t i = 300; i < 303; ++i) observations[i].sample.sensor_force_n.z = -3.0 * largest_n;
  ContactIdentification identification(ContactTask{}, rig(hal::RigKind::kHardware));
  feed(identification, observations);
  const auto model = identification.finish();
  EXPECT_TRUE(model) << model.error().text();
}

TEST(ContactIdentification, TakesTwoMillionSamplesInBoundedMemory) {
  ContactIdentification identification(hunt_crossley_task(), rig());
  auto observations = synthetic_observations(kLaw, kDepthMm);
  std::int64_t time_ns = 0;
  for (std::size_t total = 0; total < 2'000'000;) {
    for (rt::Observation& o : observations) {
      time_ns += 1'000'000;
      o.sample.time_ns = time_ns;
      identification.add(o);
      ++total;
    }
  }
  const auto model = identification.finish();
  ASSERT_TRUE(model);
  EXPECT_LT(law_displacement_error(kLaw, std::get<rt::ContactModel>(model->content).hunt_crossley->parameters,
                                   kDepthMm, kLateMm),
            0.03);
  EXPECT_LE(identification.progress().fit.size(), 200U);
}

TEST(ContactIdentification, FindsTheSurfaceOfASlowUnevenRecording) {
  constexpr double kRateHz = 10.0;
  ContactIdentification identification(hunt_crossley_task(), rig(hal::RigKind::kReplay, kRateHz));
  rt::Observation o;
  double t = 0.0;
  for (int i = 0; i < 900; ++i) {
    t += i % 3 == 0 ? 0.07 : 0.115;
    // Loaded from a preload 0.2 mm behind the surface, held, let go.
    const double way = t < 40.0 ? 0.15 * t : (t < 50.0 ? 6.0 : std::max(0.0, 6.0 - 0.8 * (t - 50.0)));
    const double rate = t < 40.0 ? 0.15 : (t < 50.0 || way <= 0.0 ? 0.0 : -0.8);
    o.sample.time_ns = std::llround(1e9 * t);
    o.sample.tip_position_mm.z = -way;
    o.sample.sensor_force_n.z = rt::hunt_crossley_force_n({0.2, 0.01, 1.4}, way + 0.2, rate);
    identification.add(o);
  }
  const auto model = value_of(identification.finish());
  EXPECT_NEAR(parameter(model, "contact_point_mm").value, -0.2, 0.05);
  EXPECT_NEAR(parameter(model, "exponent").value, 1.4, 0.05);
  EXPECT_EQ(identification.next_request().motion, MotionRequest::Motion::kRest);
}

TEST(ContactIdentification, FitsARealCycleWithUnloadingAsOthersDo) {
  const auto path = real_recording("silicone_indentation/cycle_8.csv");
  if (path.empty()) GTEST_SKIP() << "HAPTICD_RECORDINGS has no such recording";
  const auto recording = value_of(replay::load_recording(path.string(), {}));
  ContactIdentification identification(ContactTask{}, recording_rig(1.0 / recording.median_step_s));
  play(identification, recording);
  const auto model = value_of(identification.finish());
  EXPECT_LT(model.residual, 0.10);
  EXPECT_LT(std::get<rt::ContactModel>(model.content).creep->relative_error, 0.03);
}

// --- its parts ---

TEST(PalpationTracker, FindsTheSurfaceAndKeepsItThroughAGap) {
  PalpationTracker tracker(0.0, 0.02, 0.007, 1000.0);
  const auto observations = synthetic_observations(kLaw, kDepthMm);
  PalpationSample last;
  std::size_t i = 0;
  for (; i < 5000; ++i) last = tracker.update(observations[i].sample);
  ASSERT_TRUE(tracker.touched());
  EXPECT_NEAR(tracker.surface_mm(), 3.0 + kLateMm, 0.05);
  const double surface_mm = tracker.surface_mm();
  tracker.restart();
  for (i += 300; i < observations.size(); ++i) last = tracker.update(observations[i].sample);
  EXPECT_TRUE(tracker.settled());
  EXPECT_EQ(tracker.surface_mm(), surface_mm);
  EXPECT_GT(tracker.contacts(), 3U);
}

TEST(RecordedPalpation, TellsTheVelocityOfUnevenSteps) {
  for (const double rate_hz : {10.0, 200.0, 1000.0}) {
    RecordedPalpation recording(0.02, rate_hz);
    PalpationSample out;
    hal::RigSample sample;
    double t = 0.0;
    for (int i = 0; i < 200; ++i) {
      t += (i % 2 == 0 ? 0.7 : 1.3) / rate_hz;
      sample.time_ns = std::llround(1e9 * t);
      sample.tip_position_mm.z = -(2.0 + 3.0 * t - 0.4 * t * t);  // a parabola is followed exactly
      sample.sensor_force_n.z = 1.0;
      if (!recording.update(sample, out)) continue;
      ASSERT_NEAR(out.rate_mm_per_s, 3.0 - 0.8 * out.time_s, 1e-4) << rate_hz;
      ASSERT_TRUE(out.in_contact);
    }
  }
}

TEST(SampleGate, SeesASensorAtItsEndWithoutKnowingItsRange) {
  SampleGate gate(palpation_policy(rig(hal::RigKind::kReplay, 100.0)));
  hal::RigSample sample;
  for (int i = 0; i < 200; ++i) {
    const double depth = 0.05 * i;
    sample.time_ns = 10'000'000LL * i;
    sample.tip_position_mm.z = -depth;
    sample.sensor_force_n.z = std::min(3.0, 0.5 * depth);
    gate.judge(sample);
  }
  EXPECT_GT(gate.left_out(Unfit::kSaturated), 60U);  // from 6 mm of 10 on
  EXPECT_LT(gate.left_out(Unfit::kSaturated), 81U);
}

TEST(CoverageMap, NamesWhatIsMissing) {
  const ContactDomain domain{10.0, 80.0, true, 20};
  std::vector<PalpationSample> palpation;
  const Coverage none = contact_coverage(palpation, 1, domain);
  EXPECT_EQ(none.share, 0.0);
  EXPECT_EQ(missing_coverage(none, domain).front().words,
            "press faster: 60 mm/s and more between 2 and 6 mm");
  for (double x = 0.01; x < 10.0; x += 0.01) {
    for (const double v : {-40.0, 0.0, 40.0}) palpation.push_back({x, v, 1.0, true});
  }
  const Coverage slow = contact_coverage(palpation, 1, domain);
  ASSERT_EQ(missing_coverage(slow, domain).size(), 1U);
  EXPECT_EQ(missing_coverage(slow, domain).front().need, CoverageNeed::kFast);
  for (double x = 0.01; x < 6.0; x += 0.01) palpation.push_back({x, 90.0, 1.0, true});
  EXPECT_EQ(contact_coverage(palpation, 1, domain).share, 1.0);
  EXPECT_TRUE(missing_coverage(contact_coverage(palpation, 1, domain), domain).empty());
}

TEST(ContactRequests, BeginGentlyAndNeverAskForMoreThanTwiceTheForce) {
  PalpationNeeds needs;
  needs.force_n = 5.0;
  EXPECT_LE(next_palpation(needs).force_n, 2.5);
  needs.largest_force_n = 2.0;
  needs.displacement_mm = 50.0;
  needs.deepest_mm = 1.0;
  EXPECT_LE(next_palpation(needs).force_n, 10.0);
  needs.deepest_mm = 50.0;
  needs.largest_force_n = 5.0;
  needs.steady = needs.certain = true;
  EXPECT_EQ(next_palpation(needs).motion, MotionRequest::Motion::kRest);
}

}  // namespace
}  // namespace hapticd::identification
