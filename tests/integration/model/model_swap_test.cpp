#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <mutex>
#include <thread>
#include <vector>

#include "hal/sim/simulated_rig.h"
#include "rt/record/tick_record.h"
#include "server/model/store/model_library.h"
#include "server/model/store/model_store.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "tests/support/model_examples.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/value_of.h"

namespace hapticd::server {
namespace {

constexpr const char* kObject = "foam_ball_3d";
/// The law alone shows the displacement: what is rendered shows at once which model is at work.
constexpr const char* kScene =
    "name = \"swapped\"\nkind = \"explore\"\nobject_model = \"foam_ball_3d\"\n"
    "[tool]\ntip = \"ball_bearing\"\nmass_g = 0\n[contact]\nthreshold_n = 0\n"
    "[displacement]\nestimator = \"inverse\"\n[target]\nstiffness_n_per_mm = 0.3\n";

double norm(const hal::Vector3& v) {
  return std::sqrt(dot(v, v));
}

/// Scenes with a store on a simulated rig in virtual time, without the network, and all that its loop
/// reported.
class SwapBench {
 public:
  SwapBench()
      : store_(std::move(*ModelStore::open(""))),
        session_(rig(), hapticd::test::quiet_loop()),
        scenes_(session_, SceneLibrary(), ModelLibrary("", store_)) {
    session_.start();
    reader_ = std::thread([this] {
      rt::TickRecord record;
      while (!done_.load()) {
        bool some = false;
        while (session_.engine().pop_record(record)) {
          const std::lock_guard lock(mutex_);
          records_.push_back(record);
          some = true;
        }
        if (!some) std::this_thread::sleep_for(std::chrono::microseconds(200));
      }
    });
  }
  ~SwapBench() {
    session_.stop();
    done_.store(true);
    reader_.join();
  }

  /// The model that was identified on the object, its displacements so many times what they are.
  std::string add(double stretch, const std::string& tag) {
    rt::IdentifiedModel model = test::example_base(kObject, 0);
    model.device = scenes_.rig_info().device.model;
    model.sensor = scenes_.rig_info().sensor.model;
    rt::ContactModel contact;
    contact.creep = ModelLibrary().find(kObject)->creep;
    for (double& mm : contact.creep->parameters.displacement_mm) mm *= stretch;
    model.content = contact;
    model.validity.max_displacement_mm *= stretch;
    const std::string hash = store_->add(model)->hash;
    EXPECT_TRUE(store_->tag(hash, tag));
    return hash;
  }
  /// A model that was identified on this rig, for use from now on.
  std::string put(rt::IdentifiedModel model) {
    model.device = scenes_.rig_info().device.model;
    model.sensor = scenes_.rig_info().sensor.model;
    const std::string hash = store_->add(model)->hash;
    EXPECT_TRUE(store_->tag(hash, "current"));
    return hash;
  }

  Outcome<SceneHost::Loaded> load(const std::string& tag,
                                  std::chrono::milliseconds timeout = std::chrono::seconds(60),
                                  const char* scene = kScene) {
    Caller caller{.deadline = Caller::Clock::now() + timeout};
    return scenes_.load({SceneSource::Kind::kToml, scene, std::string(kObject) + "@" + tag}, caller);
  }
  void hand(double force_n, double hold_s, int repetitions) {
    sim::HandProgram program{.kind = sim::HandProgram::Kind::kPress,
                             .force_n = force_n,
                             .force_rate_n_per_s = 8.0,
                             .approach_mm_per_s = 40.0,
                             .hold_s = hold_s,
                             .repetitions = repetitions};
    EXPECT_FALSE(session_.simulation()->set_program(program));
  }
  /// Waits until the last tick in the records is one that the test wants.
  template <class Wanted>
  std::uint64_t await(Wanted wanted) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    std::size_t seen = count();
    while (std::chrono::steady_clock::now() < until) {
      {
        const std::lock_guard lock(mutex_);
        for (; seen < records_.size(); ++seen) {
          if (wanted(records_[seen])) return records_[seen].tick;
        }
      }
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    ADD_FAILURE() << "waited in vain";
    return 0;
  }
  /// Waits for a contact after a tick: the reader lags behind the loop, and what it reads next may be older
  /// than an answer.
  std::uint64_t await_deep_contact(std::uint64_t after_tick = 0) {
    return await([after_tick](const rt::TickRecord& r) {
      return r.tick > after_tick && r.in_contact && r.displacement_mm > 2.0 && norm(r.device_command_n) > 0.2;
    });
  }
  /// Records from a tick on; copied briefly, for the loop waits for its reader.
  std::vector<rt::TickRecord> records(std::uint64_t from_tick) {
    const std::lock_guard lock(mutex_);
    const auto from =
        std::lower_bound(records_.begin(), records_.end(), from_tick,
                         [](const rt::TickRecord& r, std::uint64_t tick) { return r.tick < tick; });
    return {from, records_.end()};
  }
  SceneHost& scenes() { return scenes_; }
  ModelStore& store() { return *store_; }
  Session& session() { return session_; }

 private:
  std::size_t count() {
    const std::lock_guard lock(mutex_);
    return records_.size();
  }
  static std::unique_ptr<hal::Rig> rig() {
    sim::SimulationConfig config{
        .device = "phantom_1_5_high_force", .object = kObject, .tip = "ball_bearing"};
    return std::move(*sim::SimulatedRig::create(config));
  }

  std::shared_ptr<ModelStore> store_;
  Session session_;
  SceneHost scenes_;
  std::atomic<bool> done_{false};
  std::mutex mutex_;
  std::deque<rt::TickRecord> records_;
  std::thread reader_;
};

/// A bench with a model that is right and one whose displacements are too large.
struct RightAndWrong : SwapBench {
  const std::string right = add(1.0, "right");
  const std::string wrong = add(1.6, "wrong");
};

/// The largest change of the device's force from one tick to the next in [from, to].
double largest_step_n(const std::vector<rt::TickRecord>& records, std::uint64_t from, std::uint64_t to) {
  double largest = 0.0;
  for (std::size_t i = 1; i < records.size(); ++i) {
    if (records[i].tick < from || records[i].tick > to) continue;
    largest = std::max(largest, norm(records[i].device_command_n - records[i - 1].device_command_n));
  }
  return largest;
}

/// What the hand feels over what it should, at rest in the depth of the presses after a tick.
double felt_over_target(const std::vector<rt::TickRecord>& records, std::uint64_t after) {
  double felt = 0.0;
  double wanted = 0.0;
  for (const rt::TickRecord& r : records) {
    const bool counts = r.tick > after && r.in_contact && r.truth.displacement_mm > 2.0 &&
                        std::abs(r.velocity_mm_per_s) < 1.0;
    if (!counts) continue;
    felt += norm(r.truth.hand_force_n);
    wanted += r.target_stiffness_n_per_mm * r.truth.displacement_mm;
  }
  return felt / wanted;
}

TEST(ModelSwap, WaitsForTheContactToEndAndRendersTheNewModelFromThen) {
  RightAndWrong bench;
  const auto wrong = test::value_of(bench.load("wrong"));
  bench.hand(3.0, 1.0, -1);
  double worst_step_n = 0.0;
  for (int swap = 0; swap < 4; ++swap) {
    const std::string tag = swap % 2 == 0 ? "right" : "wrong";
    const std::uint64_t asked_at = bench.await_deep_contact();
    const auto loaded = test::value_of(bench.load(tag));
    const std::uint64_t at = loaded.effective_tick;
    bench.await_deep_contact(at);
    bench.await([](const rt::TickRecord& r) { return !r.in_contact; });
    const auto records = bench.records(asked_at);
    EXPECT_GT(at, asked_at);
    bool was_in_contact = false;
    double force_n = 0.0;
    for (const rt::TickRecord& r : records) {
      was_in_contact = was_in_contact || (r.tick >= asked_at && r.tick < at && r.in_contact);
      if (r.tick + 50 >= at && r.tick <= at) {
        EXPECT_FALSE(r.in_contact) << "tick " << r.tick << " of " << at;
      }
      if (r.tick + 20 >= at && r.tick <= at + 20) force_n = std::max(force_n, norm(r.device_command_n));
    }
    EXPECT_TRUE(was_in_contact) << "or nothing was waited for";
    // What remains is the compensation of the device's own friction: 0.7 of 0.2 N.
    EXPECT_LT(force_n, 0.15);
    worst_step_n = std::max(worst_step_n, largest_step_n(records, at - 20, at + 20));
    const double felt = felt_over_target(records, at);
    if (tag == "right") {
      EXPECT_NEAR(felt, 1.0, 0.1);
    } else {
      EXPECT_GT(felt, 1.3) << "a model that takes the object for softer is asked for more force";
    }
  }
  EXPECT_LT(worst_step_n, 0.05);
  RecordProperty("largest_step_mn", static_cast<int>(1e3 * worst_step_n));
}

TEST(ModelSwap, AnotherSceneTakesTheForceAwayAtOnceButSoftly) {
  SwapBench bench;
  bench.add(1.0, "right");
  ASSERT_TRUE(bench.load("right"));
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  const std::string other = std::string(kScene) + "ramp_s = 0.2\n";
  const auto loaded = test::value_of(bench.load("right", std::chrono::seconds(60), other.c_str()));
  bench.await([&](const rt::TickRecord& r) { return r.tick > loaded.effective_tick + 100; });
  const auto records = bench.records(loaded.effective_tick - 50);
  // The force at the time of the exchange depends on how long the object has been yielding by then.
  double before_n = 0.0;
  double after_n = 0.0;
  for (const rt::TickRecord& r : records) {
    if (r.tick + 1 == loaded.effective_tick) before_n = norm(r.device_command_n);
    if (r.tick >= loaded.effective_tick) {
      EXPECT_FALSE(r.in_contact) << "the tool was not seen free";
    }
    if (r.tick == loaded.effective_tick + 60) after_n = norm(r.device_command_n);
  }
  EXPECT_GT(before_n, 0.05);
  EXPECT_LT(after_n, 0.5 * before_n);
  EXPECT_LT(largest_step_n(records, loaded.effective_tick, loaded.effective_tick + 60), 0.05);

  // No scene means no force, at once.
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  const auto unloaded = hapticd::test::value_of(bench.scenes().unload(Caller{}));
  bench.await([&](const rt::TickRecord& r) { return r.tick > unloaded.effective_tick + 10; });
  EXPECT_GT(largest_step_n(bench.records(unloaded.effective_tick - 5), unloaded.effective_tick,
                           unloaded.effective_tick + 10),
            0.1);
}

TEST(ModelSwap, IsRefusedWhenTheContactOutlastsTheCallAndNothingChanges) {
  RightAndWrong bench;
  ASSERT_TRUE(bench.load("right"));
  const auto before = bench.scenes().current();
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  const auto refused = hapticd::test::refusal_of(bench.load("wrong", std::chrono::milliseconds(400)));
  EXPECT_EQ(refused.kind, RefusalKind::kDeadlineExceeded);
  EXPECT_EQ(refused.error.what, "the tip is in contact: a model is exchanged out of contact only");
  EXPECT_EQ(bench.scenes().current(), before);
  bench.await([](const rt::TickRecord& r) { return r.in_contact; });
  // Unloading is never kept waiting.
  EXPECT_TRUE(bench.scenes().unload(Caller{}));
}

TEST(ModelSwap, TargetsPassWhileAModelWaits) {
  RightAndWrong bench;
  ASSERT_TRUE(bench.load("right"));
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  std::atomic<bool> over{false};
  std::thread waits([&] {
    EXPECT_FALSE(bench.load("wrong", std::chrono::milliseconds(700)));
    over.store(true);
  });
  for (int i = 0; i < 5; ++i) {
    const auto hold = bench.scenes().hold(Caller::Clock::now() + std::chrono::milliseconds(500));
    EXPECT_TRUE(hold.held());
  }
  EXPECT_FALSE(over.load());
  waits.join();
}

TEST(ModelSwap, WhileLatchedOrFreeItIsAtOnce) {
  RightAndWrong bench;
  ASSERT_TRUE(bench.load("right"));
  ASSERT_TRUE(bench.load("wrong", std::chrono::seconds(10))) << "no one touches anything";
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  bench.session().engine().stop();
  bench.await([](const rt::TickRecord& r) { return r.guard_state == rt::GuardState::kLatched; });
  EXPECT_TRUE(bench.load("right", std::chrono::seconds(10))) << "no force that could be missed";
}

TEST(ModelSwap, AModelInUseIsKnownAndOneThatWasDeletedMeanwhileIsNotLoaded) {
  RightAndWrong bench;
  ASSERT_TRUE(bench.load("right"));
  EXPECT_TRUE(bench.scenes().uses(bench.right));
  EXPECT_FALSE(bench.scenes().uses(bench.wrong));
  bench.hand(3.0, -1.0, 1);
  bench.await_deep_contact();
  std::thread waits([&] {
    const auto refused = bench.load("wrong");
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.refusal().kind, RefusalKind::kAborted) << refused.refusal().error.text();
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // it waits for the tip, or has not begun to
  const auto uses = [&](const std::string& hash) { return bench.scenes().uses(hash); };
  EXPECT_FALSE(bench.store().erase(bench.right, uses));
  const bool erased = static_cast<bool>(bench.store().erase(bench.wrong, uses));
  EXPECT_TRUE(erased);
  sim::HandProgram rest;
  EXPECT_FALSE(bench.session().simulation()->set_program(rest));
  waits.join();
}

// -- what was identified of the rig

TEST(RigModels, FillWhatASceneLeavesToTheRigAndAreReportedOf) {
  SwapBench bench;
  bench.add(1.0, "current");
  const auto put = [&](rt::ModelContent content, bool converged = true) {
    rt::IdentifiedModel model = test::example_of_rig(std::move(content));
    model.parameters = {{"mass_g", "g", 11.5, 0.04}};
    model.converged = converged;
    return bench.put(model);
  };
  const SceneSource source{SceneSource::Kind::kToml, kScene, {}};
  const auto plain = test::value_of(bench.scenes().resolve(source));
  EXPECT_TRUE(plain.remarks.empty());
  EXPECT_EQ(plain.spec.contact.threshold_n, 0.02);

  rt::ToolModel found = test::example_tool(11.5);
  found.found_under_bias = "2026-01-01T00:00:00Z/2";
  std::string zero = *found.found_under_bias;
  std::optional<hal::Vector3> gravity = hal::Vector3{0.0, 0.6, -0.8};
  bench.scenes().know_zero_by([&] { return ZeroInForce{zero, gravity}; });
  const std::string tool = put(found);
  put(test::example_structure(2.25));
  put(rt::ThresholdModel{0.0175, 0.016, 20.0});
  put(rt::GainsModel{0.31, 0.02, 0.7, 12.0}, false);
  const auto scene = test::value_of(bench.scenes().resolve(source));
  EXPECT_EQ(scene.spec.tool_mass_g, 11.5);
  EXPECT_EQ(scene.spec.structural_stiffness_n_per_mm, 2.25);
  ASSERT_TRUE(scene.spec.structural_field);
  EXPECT_EQ(scene.spec.structural_field->gradient_per_mm.x, 0.001) << "all of it";
  EXPECT_FALSE(scene.spec.explore.tip_to_centre_mm) << "the tool was not turned enough to report";
  EXPECT_EQ(scene.spec.contact.threshold_n, 0.0175);
  EXPECT_EQ(scene.spec.controller.proportional_gain, 0.31);
  EXPECT_EQ(scene.spec.controller.derivative_gain_ms, 0.02);
  EXPECT_EQ(scene.stored.size(), 5U) << "and the object's";
  ASSERT_EQ(scene.remarks.size(), 5U);
  EXPECT_EQ(scene.remarks[0], "tool.gravity_at_bias: the tool was tilted by 37° when the sensor was biased");
  EXPECT_EQ(scene.spec.explore.gravity_at_bias.y, 0.6);
  ASSERT_TRUE(scene.spec.explore.sensor_mounting);
  EXPECT_EQ(scene.spec.explore.sensor_mounting->force_bias_n.x, found.force_bias_n.x);
  EXPECT_EQ(scene.remarks[1], "tool.mass_g = 11.5 ± 0.04 g: from stored model " + tool.substr(0, 12) +
                                  "; with the sensor's bias of 0.0374 N and its seat, turned by 3°");
  EXPECT_NE(scene.remarks[4].find("which had not converged"), std::string::npos) << scene.remarks[4];

  std::string silent = kScene;
  silent.erase(silent.find("mass_g = 0"), 10);
  silent.erase(silent.find("threshold_n = 0"), 15);
  const auto left_open = test::value_of(bench.scenes().resolve({SceneSource::Kind::kToml, silent, {}}));
  EXPECT_EQ(left_open.spec.tool_mass_g, 11.5);
  EXPECT_EQ(left_open.spec.contact.threshold_n, 0.0175);

  // Under another bias the one that was found means nothing: what is read is the weight, as the tool hung
  // then.
  zero = "2026-01-01T00:00:00Z/3";
  const auto later = test::value_of(bench.scenes().resolve(source));
  const auto& mounting = later.spec.explore.sensor_mounting;
  ASSERT_TRUE(mounting);
  EXPECT_NEAR(rt::norm(mounting->force_bias_n), 11.5e-6 * rt::ToolLoad::kGravityMmPerS2, 1e-9);
  EXPECT_EQ(mounting->turn_deg.x, scene.spec.explore.sensor_mounting->turn_deg.x) << "the seat stays";
  EXPECT_NE(later.remarks[1].find("under another bias"), std::string::npos) << later.remarks[1];

  gravity.reset();

  // What a scene says by itself it keeps.
  std::string said = kScene;
  said.replace(said.find("mass_g = 0"), 10, "mass_g = 9");
  said.replace(said.find("threshold_n = 0"), 15, "threshold_n = 0.05");
  said += "[structure]\nstiffness_n_per_mm = 3\n[control]\nproportional_gain = 0.4\n";
  const auto own = test::value_of(bench.scenes().resolve({SceneSource::Kind::kToml, said, {}}));
  EXPECT_EQ(own.spec.tool_mass_g, 9.0);
  EXPECT_EQ(own.spec.contact.threshold_n, 0.05);
  EXPECT_EQ(own.spec.structural_stiffness_n_per_mm, 3.0);
  EXPECT_EQ(own.spec.controller.proportional_gain, 0.4);
  EXPECT_TRUE(own.remarks.empty());

  put(rt::GainsModel{1.9, 0.5, 2.0, 12.0});
  const auto wild = test::value_of(bench.scenes().resolve(source));
  EXPECT_NE(wild.spec.controller.proportional_gain, 1.9);
  EXPECT_NE(wild.remarks[3].find("not used: unstable at 1000 Hz"), std::string::npos) << wild.remarks[3];

  put(rt::ThresholdModel{0.414, 0.4, 20.0});
  const auto touched = test::value_of(bench.scenes().resolve(source));
  EXPECT_EQ(touched.spec.contact.threshold_n, 0.02);
  EXPECT_NE(touched.remarks[2].find("not used: more than contact.zero_bound_n"), std::string::npos)
      << touched.remarks[2];
}

TEST(RigModels, TheCentreOfAToolsMassReachesTheScene) {
  SwapBench bench;
  bench.add(1.0, "current");
  rt::ToolModel tool = test::example_tool();
  tool.tip_to_centre_mm = {2.0, -3.0, 42.0};
  bench.put(test::example_of_rig(tool));
  const auto scene = test::value_of(bench.scenes().resolve({SceneSource::Kind::kToml, kScene, {}}));
  ASSERT_TRUE(scene.spec.explore.tip_to_centre_mm);
  EXPECT_EQ(scene.spec.explore.tip_to_centre_mm->z, 42.0);
  EXPECT_NE(scene.remarks[0].find("its centre 42.2 mm from the tip"), std::string::npos) << scene.remarks[0];
}

TEST(RigModels, AnIdentifiedBallBearingsFrictionIsUsedAndSaid) {
  SwapBench bench;
  bench.add(1.0, "current");
  const SceneSource source{SceneSource::Kind::kToml, kScene, {}};
  const auto before = test::value_of(bench.scenes().resolve(source));
  ASSERT_TRUE(before.model);
  EXPECT_FALSE(before.model->model.bearing_friction);
  const std::string hash = bench.put(test::example_friction(kObject, rt::Tip::kBallBearing));
  const auto scene = hapticd::test::value_of(bench.scenes().resolve(source));
  ASSERT_TRUE(scene.model && scene.model->model.bearing_friction);
  EXPECT_EQ(scene.model->model.bearing_friction->kinetic, 0.4);
  EXPECT_TRUE(std::find(scene.stored.begin(), scene.stored.end(), hash) != scene.stored.end());
  ASSERT_EQ(scene.remarks.size(), 1U);
  EXPECT_EQ(scene.remarks[0], "friction of the ball bearing: 0.4, from stored model " + hash.substr(0, 12));
  EXPECT_TRUE(bench.scenes().compose(scene));
}

TEST(RigModels, ASceneReportedOfItsModelsSaysWhatSpeaksAgainstThem) {
  SwapBench bench;
  rt::IdentifiedModel model = test::example_contact(kObject);
  model.device = "phantom_1_0";
  model.converged = false;
  const std::string hash = bench.store().add(model)->hash;
  ASSERT_TRUE(bench.store().tag(hash, "current"));
  std::string text = kScene;
  text.replace(text.find("stiffness_n_per_mm = 0.3"), 24,
               "law = \"displacement_profile\"\nprofile = [[0, 0.2], [9, 0.5]]");
  const auto scene = test::value_of(bench.scenes().resolve({SceneSource::Kind::kToml, text, {}}));
  ASSERT_EQ(scene.needs.size(), 1U);
  EXPECT_TRUE(scene.needs[0].available);
  EXPECT_EQ(
      scene.needs[0].remark,
      "rms error 5 %; stored model " + hash.substr(0, 12) +
          "; palpation, \"recursive\" then batch; ε = 0.02; had not converged; identified on another device: "
          "phantom_1_0 instead of phantom_1_5_high_force; identified down to 6.1 mm only, the target goes to "
          "9 mm");
  EXPECT_TRUE(bench.scenes().compose(scene)) << "cautions, no obstacles";

  // Friction of the wrong tip: an obstacle.
  const std::string bearing = bench.store().add(test::example_friction("gel", rt::Tip::kBallBearing))->hash;
  const std::string gel = bench.store().add(test::example_contact("gel"))->hash;
  ASSERT_TRUE(bench.store().tag(bearing, "current"));
  ASSERT_TRUE(bench.store().tag(gel, "current"));
  text = kScene;
  text.replace(text.find("ball_bearing"), 12, "rod");
  const auto rod = hapticd::test::value_of(bench.scenes().resolve({SceneSource::Kind::kToml, text, "gel"}));
  const auto refused = hapticd::test::refusal_of(bench.scenes().compose(rod));
  EXPECT_EQ(refused.kind, RefusalKind::kFailedPrecondition);
  EXPECT_NE(refused.error.remedy.find("its friction was identified with the ball bearing"), std::string::npos)
      << refused.error.text();
}

}  // namespace
}  // namespace hapticd::server
