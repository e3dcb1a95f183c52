#include "hal/composed_rig.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <thread>

#include "allocation_counter.h"
#include "rt/loop/engine.h"
#include "rt/loop/periodic_loop.h"

namespace hapticd::hal {
namespace {

namespace status = sample_status;
using namespace std::chrono_literals;

class FakeBase final : public Rig {
 public:
  FakeBase() {
    info_.name = "base";
    info_.has_truth = true;
    info_.device.model = "base_device";
    info_.sensor.model = "base_sensor";
  }
  const RigInfo& info() const noexcept override { return info_; }
  bool owns_clock() const noexcept override { return false; }
  void read(RigSample& sample) noexcept override {
    sample = RigSample{};
    sample.tip_position_mm = {1.0, 2.0, 3.0};
    sample.sensor_force_n = {4.0, 5.0, 6.0};
    sample.force_count = 10;
    sample.status = all_bits;
  }
  void write(const DeviceCommand& command) noexcept override { written = command; }

  std::uint32_t all_bits = 0;
  DeviceCommand written{{-1.0, -1.0, -1.0}};

 private:
  RigInfo info_;
};

class FakeDevice : public HapticDevice {
 public:
  FakeDevice() { info_.model = "fake_device"; }
  std::optional<Error> engage() override {
    if (refuses) return Error{"refused", "haptic device", "", "", ""};
    engaged = true;
    ++engagements;
    info_.max_force_n = 7.0;  // reported by the device itself
    return std::nullopt;
  }
  void disengage() noexcept override { engaged = false; }
  PartReport report() const override { return {"haptic device", "fake", PartState::kReady, "", {}, {}}; }
  const DeviceInfo& info() const noexcept override { return info_; }
  void read(RigSample& sample) noexcept override {
    if (read_takes > 0ms) std::this_thread::sleep_for(read_takes);
    sample.tip_position_mm = {0.0, 0.0, -7.0};
    sample.status |= status::kDeviceWarm;
  }
  void write(const DeviceCommand& command) noexcept override {
    written = command;
    ++writes;
  }
  std::optional<Error> home() override {
    homed = true;
    return std::nullopt;
  }

  std::chrono::milliseconds read_takes{0};
  bool refuses = false;
  std::atomic<bool> engaged{false};
  std::atomic<int> engagements{0};
  bool homed = false;
  DeviceCommand written;
  std::atomic<int> writes{0};

 private:
  DeviceInfo info_;
};

/// A device whose scheduler calls every millisecond, on its own thread.
class ScheduledDevice final : public FakeDevice, public ServoClock {
 public:
  ServoClock* clock() noexcept override { return this; }
  void run(ServoBody& body, const std::atomic<bool>& stop) noexcept override {
    ++runs;
    std::thread scheduler([&] {
      for (int call = 0; !stop.load() && (call < calls_of_first_run || runs > 1); ++call) {
        body.on_servo();
        std::this_thread::sleep_for(1ms);
      }
    });
    scheduler.join();
  }

  int calls_of_first_run = std::numeric_limits<int>::max();
  std::atomic<int> runs{0};
};

class FakeSensor final : public ForceSensor {
 public:
  std::optional<Error> engage() override {
    ++engagements;
    return std::nullopt;
  }
  void disengage() noexcept override { disengaged_during_read = reading.load(); }
  PartReport report() const override { return {"force sensor", "fake", PartState::kReady, "", {}, {}}; }
  const SensorInfo& info() const noexcept override { return info_; }
  void read(RigSample& sample) noexcept override {
    reading = true;
    if (read_takes > 0ms) std::this_thread::sleep_for(read_takes);
    sample.sensor_force_n = {0.0, 0.0, 9.0};
    sample.force_count = 7;
    sample.force_age_ns = 100;
    sample.bias_serial = bias_serial;
    sample.status |= status::kForceWarning;
    reading = false;
  }
  std::optional<Error> bias() override { return Error{"biased", "", "", "", ""}; }

  std::uint32_t bias_serial = 0;
  std::chrono::milliseconds read_takes{0};
  std::atomic<bool> reading{false};
  std::atomic<bool> disengaged_during_read{false};
  int engagements = 0;

 private:
  SensorInfo info_{"fake_sensor", 35.0, 0.001, 7000.0, 9.0};
};

constexpr std::uint32_t kForceBits = status::kForceMissing | status::kForceSaturated | status::kForceFault |
                                     status::kForceLost | status::kForceWarning;
constexpr std::uint32_t kDeviceBits = status::kDeviceFault | status::kDeviceNotReady | status::kDeviceWarm |
                                      status::kDeviceOverForce | status::kDeviceOverSpeed |
                                      status::kCommandStale;

struct Made {
  std::unique_ptr<ComposedRig> rig;
  FakeBase* base = nullptr;
  FakeDevice* device = nullptr;
  FakeSensor* sensor = nullptr;

  RigSample read() const {
    RigSample sample;
    rig->read(sample);
    return sample;
  }
};

Made make(bool with_base, bool with_device, bool with_sensor) {
  Made made;
  RigParts parts;
  if (with_base) {
    auto base = std::make_unique<FakeBase>();
    made.base = base.get();
    parts.base = std::move(base);
  }
  if (with_device) {
    auto device = std::make_unique<FakeDevice>();
    made.device = device.get();
    parts.device = std::move(device);
  }
  if (with_sensor) {
    auto sensor = std::make_unique<FakeSensor>();
    made.sensor = sensor.get();
    parts.sensor = std::move(sensor);
  }
  made.rig = std::make_unique<ComposedRig>(std::move(parts), 1000.0);
  return made;
}

/// Sees the tip along z only, and only while something comes.
class FakeInstrument final : public TipInstrument {
 public:
  std::optional<Error> engage() override {
    engaged = true;
    return std::nullopt;
  }
  void disengage() noexcept override { engaged = false; }
  PartReport report() const override {
    return {"instrument from outside", "fake", PartState::kReady, "", {}, {}};
  }
  bool read(Vector3& position_mm) noexcept override {
    if (has_reading) position_mm.z = -7.5;
    return has_reading;
  }
  bool engaged = false;
  bool has_reading = true;
};

TEST(ComposedRig, AnInstrumentAnswersForAsLongAsItIsEngaged) {
  RigParts parts;
  parts.device = std::make_unique<FakeDevice>();
  auto made = std::make_unique<FakeInstrument>();
  FakeInstrument* const instrument = made.get();
  parts.instrument = std::move(made);
  ComposedRig rig(std::move(parts), 1000.0);
  EXPECT_TRUE(rig.info().has_external_position);
  ASSERT_FALSE(rig.engage(RigPartKind::kDevice));
  RigSample sample;
  Vector3 outside_mm{9.0, 9.0, 9.0};
  rig.read(sample);
  EXPECT_FALSE(instrument->engaged) << "opened by the one who needs it";
  EXPECT_FALSE(rig.external_position(outside_mm));
  EXPECT_EQ(outside_mm.x, 9.0);
  ASSERT_FALSE(rig.engage_instrument());
  rig.read(sample);
  ASSERT_TRUE(rig.external_position(outside_mm));
  EXPECT_EQ(outside_mm.x, sample.tip_position_mm.x) << "what it does not see is the encoders'";
  EXPECT_EQ(outside_mm.z, -7.5);
  instrument->has_reading = false;
  rig.read(sample);
  EXPECT_FALSE(rig.external_position(outside_mm));
  instrument->has_reading = true;
  rig.disengage_instrument();
  EXPECT_FALSE(instrument->engaged);
  rig.read(sample);
  EXPECT_FALSE(rig.external_position(outside_mm));
  EXPECT_EQ(rig.reports().size(), 2U);
}

TEST(ComposedRig, TakesEachHalfFromItsPartAndTheRestFromTheBase) {
  const Made made = make(true, false, true);
  made.base->all_bits = kForceBits | status::kDeviceWarm;
  EXPECT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
  const RigSample sample = made.read();
  EXPECT_EQ(sample.tip_position_mm.z, 3.0) << "the base's device";
  EXPECT_EQ(sample.sensor_force_n.z, 9.0);
  EXPECT_EQ(sample.force_count, 7U);
  EXPECT_EQ(sample.status, status::kDeviceWarm | status::kForceWarning)
      << "what is wrong with the base's sensor concerns no one";
}

TEST(ComposedRig, OverridesTheDeviceHalfToo) {
  const Made made = make(true, true, false);
  made.base->all_bits = kDeviceBits | status::kForceSaturated;
  EXPECT_FALSE(made.rig->engage(RigPartKind::kDevice));
  const RigSample sample = made.read();
  EXPECT_EQ(sample.tip_position_mm.z, -7.0);
  EXPECT_EQ(sample.sensor_force_n.z, 6.0) << "the base's sensor";
  EXPECT_EQ(sample.status, status::kForceSaturated | status::kDeviceWarm);
}

TEST(ComposedRig, GivesForceToTheRealDeviceAndNoOneElse) {
  const Made made = make(true, true, false);
  ASSERT_FALSE(made.rig->engage(RigPartKind::kDevice));
  made.rig->write({{0.0, 0.0, 2.0}});
  EXPECT_EQ(made.device->written.force_n.z, 2.0);
  EXPECT_EQ(made.base->written.force_n.z, -1.0) << "untouched";

  const Made without_device = make(true, false, true);
  without_device.rig->write({{0.0, 0.0, 2.0}});
  EXPECT_EQ(without_device.base->written.force_n.z, 2.0);
}

TEST(ComposedRig, SaysOfPartsThatAreNotEngagedThatTheyAreNotThere) {
  const Made made = make(false, true, true);
  const RigSample sample = made.read();
  EXPECT_EQ(sample.status, status::kDeviceNotReady | status::kForceMissing);
  EXPECT_EQ(sample.force_age_ns, std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(sample.force_count, 0U);
  made.rig->write({{0.0, 0.0, 2.0}});
  EXPECT_EQ(made.device->writes, 0);
}

TEST(ComposedRig, KeepsTheLastPoseOfADeviceThatWasLetGo) {
  const Made made = make(false, true, false);
  ASSERT_FALSE(made.rig->engage(RigPartKind::kDevice));
  made.read();
  made.rig->disengage(RigPartKind::kDevice);
  const RigSample sample = made.read();
  EXPECT_EQ(sample.tip_position_mm.z, -7.0);
  EXPECT_NE(sample.status & status::kDeviceNotReady, 0U);
}

TEST(ComposedRig, DescribesWhatItIsPutTogetherOf) {
  const Made made = make(true, true, true);
  const RigInfo& info = made.rig->info();
  EXPECT_EQ(info.kind, RigKind::kHardware);
  EXPECT_EQ(info.name, "fake + fake + base");
  EXPECT_EQ(info.device.model, "fake_device");
  EXPECT_EQ(info.sensor.model, "fake_sensor");
  EXPECT_FALSE(info.has_truth) << "the base knows nothing of the real parts";
  EXPECT_EQ(made.rig->reports().size(), 2U);
  ASSERT_FALSE(made.rig->engage(RigPartKind::kDevice));
  EXPECT_EQ(info.device.max_force_n, 7.0) << "as the device says itself";
}

TEST(ComposedRig, PassesOnWhatAPartRefuses) {
  const Made made = make(false, true, true);
  made.device->refuses = true;
  const auto error = made.rig->engage(RigPartKind::kDevice);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->what, "refused");
  EXPECT_NE(made.read().status & status::kDeviceNotReady, 0U);
  EXPECT_EQ(made.rig->bias_force_sensor()->what, "biased");
  EXPECT_FALSE(made.rig->home_device());
  EXPECT_TRUE(made.device->homed);

  const Made bare = make(true, false, false);
  EXPECT_TRUE(bare.rig->bias_force_sensor());
  EXPECT_TRUE(bare.rig->home_device());
}

TEST(ComposedRig, CountsTicksAndTimeByItselfWithoutABase) {
  const Made made = make(false, true, true);
  const RigSample first = made.read();
  const RigSample second = made.read();
  EXPECT_EQ(first.tick, 0U);
  EXPECT_EQ(first.time_ns, 0);
  EXPECT_EQ(second.tick, 1U);
  EXPECT_GE(second.time_ns, first.time_ns);
}

TEST(ComposedRig, TimeIsTheInstantInWhichTheDeviceWasRead) {
  const Made made = make(false, true, true);
  made.device->read_takes = 3ms;
  EXPECT_FALSE(made.rig->engage(RigPartKind::kDevice));
  EXPECT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
  made.read();
  const auto begun = std::chrono::steady_clock::now();
  const std::int64_t before_ns = made.read().time_ns;
  std::this_thread::sleep_for(2ms);
  const std::int64_t after_ns = made.read().time_ns;
  const auto took = std::chrono::steady_clock::now() - begun;
  EXPECT_GE(after_ns - before_ns, 5'000'000) << "the pause and the device's own 3 ms";
  EXPECT_LE(after_ns - before_ns, std::chrono::nanoseconds(took).count());
}

TEST(ComposedRig, TheZerosSerialNumberOutlastsTheSensor) {
  const Made made = make(true, false, true);
  EXPECT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
  made.sensor->bias_serial = 5;
  EXPECT_EQ(made.read().bias_serial, 5U);
  made.rig->disengage(RigPartKind::kForceSensor);
  const RigSample gone = made.read();
  EXPECT_EQ(gone.bias_serial, 5U);
  EXPECT_EQ(gone.force_mean_age_ns, std::numeric_limits<std::int64_t>::max());
}

TEST(ComposedRig, NeverLetsGoOfASensorInTheMiddleOfARead) {
  const Made made = make(false, false, true);
  made.sensor->read_takes = 2ms;
  ASSERT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
  std::atomic<bool> stop{false};
  std::thread loop([&] {
    while (!stop.load()) made.read();
  });
  for (int i = 0; i < 30; ++i) {
    made.rig->disengage(RigPartKind::kForceSensor);
    ASSERT_FALSE(made.sensor->disengaged_during_read.load());
    ASSERT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
    std::this_thread::sleep_for(1ms);
  }
  stop = true;
  loop.join();
}

TEST(ComposedRig, ReadsAndWritesWithoutAllocating) {
  const Made made = make(true, true, true);
  ASSERT_FALSE(made.rig->engage(RigPartKind::kDevice));
  ASSERT_FALSE(made.rig->engage(RigPartKind::kForceSensor));
  RigSample sample;
  const long before = test::allocations();
  for (int i = 0; i < 100; ++i) {
    made.rig->read(sample);
    made.rig->write({});
  }
  EXPECT_EQ(test::allocations(), before);
}

/// A loop on nothing but a device with its own scheduler.
struct ScheduledLoop {
  explicit ScheduledLoop(int calls_of_first_run) {
    device->calls_of_first_run = calls_of_first_run;
    EXPECT_FALSE(rig.engage(RigPartKind::kDevice));
  }
  static rt::LoopConfig unprivileged() { return {.fifo_priority = 0, .lock_memory = false}; }
  static RigParts only(ScheduledDevice* device) {
    RigParts parts;
    parts.device.reset(device);
    return parts;
  }
  void await(auto condition) const {
    while (!condition(loop.statistics())) std::this_thread::sleep_for(1ms);
  }

  ScheduledDevice* device = new ScheduledDevice;  // the rig's
  ComposedRig rig{only(device), 1000.0};
  rt::Engine engine{rig};
  rt::PeriodicLoop loop{rig, engine, unprivileged()};
};

TEST(ComposedRig, ADevicesSchedulerDrivesTheLoop) {
  ScheduledLoop bench(std::numeric_limits<int>::max());
  bench.loop.start();
  bench.await([](const rt::LoopStatistics& s) { return s.ticks >= 50; });
  bench.loop.stop();
  const rt::LoopStatistics reported = bench.loop.statistics();
  EXPECT_EQ(bench.device->writes.load(), static_cast<int>(reported.ticks) + 1) << "and a zero at the end";
  EXPECT_EQ(reported.compute.count, reported.ticks);
  EXPECT_EQ(reported.device.count, reported.ticks);
  rt::TickRecord record;
  std::uint64_t records = 0;
  while (bench.engine.pop_record(record)) EXPECT_EQ(record.tick, records++);
  EXPECT_EQ(records, reported.ticks);
}

TEST(ComposedRig, ASchedulerThatDiesIsEngagedAndRunAgain) {
  ScheduledLoop bench(20);
  bench.loop.start();
  bench.await([](const rt::LoopStatistics& s) { return s.clock_losses > 0; });
  EXPECT_TRUE(bench.loop.running()) << "the loop is there as long as the daemon is";
  EXPECT_EQ(bench.loop.statistics().ticks, 20U);
  EXPECT_EQ(bench.device->writes.load(), 21) << "a zero when it died";
  bench.await([](const rt::LoopStatistics& s) { return s.ticks >= 40; });
  EXPECT_EQ(bench.device->engagements.load(), 2);
  EXPECT_EQ(bench.loop.statistics().clock_losses, 1U);
}

TEST(ComposedRig, WaitingForASchedulerTheLoopCanBeStopped) {
  ScheduledLoop bench(0);
  bench.loop.start();
  bench.await([](const rt::LoopStatistics& s) { return s.clock_losses > 0; });
  bench.loop.stop();
  EXPECT_FALSE(bench.loop.running());
}

}  // namespace
}  // namespace hapticd::hal
