// Biases of the force sensor without the network: whose take effect, and where they are written down.

#include "server/rig/sensor_bias.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "hal/sim/simulated_rig.h"
#include "server/model/store/model_library.h"
#include "server/model/store/model_store.h"
#include "server/scene/scene_host.h"
#include "server/session/session.h"
#include "server/telemetry/telemetry_hub.h"
#include "tests/support/quiet_loop.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::server {
namespace {

/// A rig at rest whose sensor a caller biases.
class SensorBiasTest : public testing::Test {
 protected:
  SensorBiasTest() {
    session_.start();
    hub_.start();
  }
  ~SensorBiasTest() override {
    hub_.stop();
    session_.stop();
  }
  /// Takes a bias that has to be refused, and expects that the zero is the same as before.
  Refusal refused(const Caller& caller) {
    // The sensor takes its first zero when it is opened.
    const auto claim = session_.claim_sensor();
    EXPECT_TRUE(claim);
    const auto until = Caller::Clock::now() + std::chrono::seconds(60);
    while (hub_.latest().bias_serial == 0 && Caller::Clock::now() < until) std::this_thread::yield();
    const std::uint32_t before = hub_.latest().bias_serial;
    const std::uint64_t tick = hub_.latest().tick;
    const auto taken = biases_.take(caller, true);
    while (hub_.latest().tick <= tick && Caller::Clock::now() < until) std::this_thread::yield();
    EXPECT_EQ(hub_.latest().bias_serial, before) << "the sensor was biased all the same";
    EXPECT_FALSE(biases_.current());
    if (!taken) return taken.refusal();
    ADD_FAILURE() << "the bias was not refused";
    return {};
  }

  std::shared_ptr<ModelStore> store_ = std::move(*ModelStore::open(""));
  Session session_{std::move(*sim::SimulatedRig::create({})), hapticd::test::quiet_loop()};
  TelemetryHub hub_{session_.engine()};
  SceneHost scenes_{session_, SceneLibrary(), ModelLibrary("", store_)};
  SensorBiases biases_{session_, scenes_, hub_, ""};
};

TEST_F(SensorBiasTest, IsNotTakenForACallerThatLostItsLeaseMeanwhile) {
  Caller caller;
  caller.lost = [] {
    return Refusal{
        RefusalKind::kAborted, {"the lease was taken by ben", "lease", "", "", ""}, Reason::kLeaseLost};
  };
  const Refusal refusal = refused(caller);
  EXPECT_EQ(refusal.kind, RefusalKind::kAborted);
  EXPECT_EQ(refusal.reason, Reason::kLeaseLost);
}

TEST_F(SensorBiasTest, IsNotTakenForACallerThatWentAwayMeanwhile) {
  Caller caller;
  caller.cancelled = [] { return true; };
  EXPECT_EQ(refused(caller).kind, RefusalKind::kCancelled);
}

TEST_F(SensorBiasTest, IsNotTakenAfterTheCallersDeadline) {
  EXPECT_EQ(refused({.deadline = Caller::Clock::now()}).kind, RefusalKind::kDeadlineExceeded);
}

TEST_F(SensorBiasTest, IsNotTakenOnceAnIdentificationHasBegunMeanwhile) {
  std::optional<SceneHost::Reservation> reservation;
  Caller caller;
  caller.lost = [&]() -> std::optional<Refusal> {  // asked after the tool was watched
    if (auto made = scenes_.reserve("identification 'contact-1'")) reservation.emplace(std::move(*made));
    return std::nullopt;
  };
  EXPECT_EQ(refused(caller).reason, Reason::kBusy);
}

TEST_F(SensorBiasTest, IsRecordedThroughNoLink) {
  const hapticd::test::TemporaryFolder folder;
  const std::string precious = folder.write("precious", "kept");
  std::filesystem::create_symlink(precious, folder.path("linked.csv"));
  SensorBiases linked(session_, scenes_, hub_, folder.path("linked.csv"));
  EXPECT_TRUE(linked.take(Caller{}, true)) << "what cannot be recorded is taken all the same";
  EXPECT_EQ(std::filesystem::file_size(precious), 4U);

  SensorBiases biases(session_, scenes_, hub_, folder.path("made/biases.csv"));
  EXPECT_TRUE(biases.take(Caller{}, true));
  EXPECT_TRUE(biases.take(Caller{}, true));
  std::ifstream file(folder.path("made/biases.csv"));
  std::string line;
  ASSERT_TRUE(std::getline(file, line));
  EXPECT_TRUE(line.starts_with("id,taken_utc,")) << line;
  for (int bias = 0; bias < 2; ++bias) {
    ASSERT_TRUE(std::getline(file, line)) << bias;
    EXPECT_EQ(line.substr(0, 2), "20") << line;
  }
  EXPECT_FALSE(std::getline(file, line)) << line;
}

}  // namespace
}  // namespace hapticd::server
