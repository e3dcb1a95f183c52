// Driver and emulated drive against implementations of the protocol by others.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "tests/support/child_process.h"
#include "tests/support/eventually.h"
#include "tests/support/value_of.h"
#include "tests/unit/modbus/driven_rig.h"

namespace hapticd::test {
namespace {

constexpr const char* kPython = "/usr/bin/python3";  // the one that sees the distribution's modules
constexpr const char* kMbpoll = "/usr/bin/mbpoll";

TEST(ModbusPeers, ADriveBehindPymodbusIsTurned) {
  if (std::system((std::string(kPython) + " -c 'import pymodbus.server.async_io' 2>/dev/null").c_str()) !=
      0) {
    GTEST_SKIP() << "python3-pymodbus is not installed: the driver was not tried against it";
  }
  ChildProcess server(kPython, {PYMODBUS_DRIVE});
  const std::string line = server.read_line();
  ASSERT_EQ(line.substr(0, 4), "tcp ") << line;

  modbus::ModbusConfig config;
  config.map = built_in_map("plain_drive");
  config.link.host = "localhost";  // a name, not an address
  config.link.port = std::atoi(line.c_str() + 4);
  config.link.response_timeout_s = 2.0;
  turntable::TurntableSettings settings = quick_settings();
  settings.stale_after_s = 5.0;
  auto table = test::value_of(modbus::create(config, settings));
  const auto engaged = table->engage();
  ASSERT_FALSE(engaged) << engaged->text();
  EXPECT_NEAR(*table->status().position_deg, 40.0, 1e-9);
  const auto end_of = [&](const hal::Result<std::uint64_t>& motion) {
    EXPECT_TRUE(motion) << motion.error().text();
    const auto until = std::chrono::steady_clock::now() + kTimeout;
    while (std::chrono::steady_clock::now() < until) {
      const hal::TurntableStatus now = table->status();
      if (now.motion.number == *motion && now.motion.end != hal::MotionEnd::kUnderWay) return now;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return table->status();
  };
  EXPECT_EQ(end_of(table->home()).motion.end, hal::MotionEnd::kArrived);
  const hal::TurntableStatus end = end_of(table->move_to(-90.0, {180.0, 0.0}));
  EXPECT_EQ(end.motion.end, hal::MotionEnd::kArrived)
      << (end.motion.problem ? end.motion.problem->text() : "");
  EXPECT_NEAR(*end.position_deg, -90.0, 1e-3);
}

/// What mbpoll prints of one request.
std::string mbpoll(const std::string& arguments) {
  std::string line(kMbpoll);
  line.append(" -1 -0 -o 5 ").append(arguments).append(" 2>&1");
  std::string output;
  FILE* pipe = popen(line.c_str(), "r");
  if (pipe == nullptr) return output;
  char part[256];
  while (std::fgets(part, sizeof part, pipe) != nullptr) output += part;
  pclose(pipe);
  return output;
}

class Mbpoll : public testing::TestWithParam<bool> {
 protected:
  void SetUp() override {
    if (access(kMbpoll, X_OK) != 0)
      GTEST_SKIP() << "mbpoll is not installed: the emulated drive was not tried with it";
  }
  EmulatedDrive drive{{EmulatedDrive::Make::kPlain, 1, GetParam() ? -1 : 0, GetParam()}};
  /// A request over TCP or the serial line; `values` are written.
  std::string ask(const std::string& what, const std::string& values = "") const {
    if (GetParam())
      return mbpoll("-m rtu -a 1 -b 115200 -P even " + what + " " + drive.serial_port() + " " + values);
    return mbpoll("-m tcp -a 1 -p " + std::to_string(drive.port()) + " " + what + " 127.0.0.1 " + values);
  }
};

INSTANTIATE_TEST_SUITE_P(Over, Mbpoll, testing::Values(false, true),
                         [](const auto& one) { return one.param ? "Rtu" : "Tcp"; });

TEST_P(Mbpoll, ReadsNumbersAndBitsOfTheEmulatedDrive) {
  EXPECT_NE(ask("-t 3:int -B -r 0").find("[0]: \t0"), std::string::npos) << ask("-t 3:int -B -r 0");
  ask("-t 4 -r 106", "1");  // enable
  ask("-t 4 -r 106", "5");  // home
  ASSERT_TRUE(eventually([&] { return drive.motor().homed(); }));
  const std::string status = ask("-t 3:hex -r 4");
  EXPECT_NE(status.find("0x000B"), std::string::npos) << status;  // enabled, homed, in position
  const std::string bit = ask("-t 1 -r 0");
  EXPECT_NE(bit.find("[0]: \t1"), std::string::npos) << bit;
}

TEST_P(Mbpoll, TurnsTheEmulatedDrive) {
  ask("-t 4 -r 106", "1");
  ask("-t 4:int -B -r 100", "12500");
  ask("-t 4:float -B -r 102", "90.0 360.0");
  ask("-t 4 -r 106", "3");
  ASSERT_TRUE(eventually([&] { return drive.motor().in_position(); }));
  EXPECT_NEAR(drive.motor().counter_deg(), 12.5, 1e-6);
  const std::string position = ask("-t 3:int -B -r 0");
  EXPECT_NE(position.find("12500"), std::string::npos) << position;
}

TEST_P(Mbpoll, IsRefusedWhereThereIsNoRegister) {
  const std::string refused = ask("-t 4 -r 50");
  EXPECT_NE(refused.find("Illegal data address"), std::string::npos) << refused;
}

}  // namespace
}  // namespace hapticd::test
