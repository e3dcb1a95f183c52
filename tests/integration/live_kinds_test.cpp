// Every kind of identification as a user starts it, over real transports: the vendor's library, a Net F/T
// box, an analog board, and mixes of them. Live and for some seconds only: that parameters come, and are
// about right. How well they are found is for the study.

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/integration/emulated_rig_process.h"

namespace hapticd::test {
namespace {

using Json = nlohmann::json;

struct LiveKind {
  const char* name;
  Arguments rig;       ///< of the emulators
  Arguments identify;  ///< of hapticctl identify
  const char* parameter;
  double low, high;  ///< where it must be
};

std::ostream& operator<<(std::ostream& out, const LiveKind& kind) {
  return out << kind.name;
}

const Arguments kPalpate{"--object", "sponge_cut", "--tip", "ball_bearing", "--program",
                         "palpate",  "--force-n",  "3",     "--hold-s",     "0.6"};
const Arguments kRub{"--object", "rubber_ball_3d", "--tip", "rod", "--program", "rub"};
const Arguments kTurn{"--object", "none", "--program", "turn"};
const Arguments kFree{"--object", "none", "--program", "free"};
const Arguments kSearch{"--object", "sponge_block", "--program", "search", "--force-n",
                        "2",        "--hold-s",     "1.2"};
const Arguments kWood{"--object", "wood_plate", "--program", "search", "--force-n", "2", "--hold-s", "1.2"};
const Arguments kWalls{"--object", "none", "--program", "walls", "--force-n", "4"};

const Arguments kDeviceOnBoard{"--device-over", "board"};
const Arguments kSensorOnBoard{"--sensor-over", "board"};
const Arguments kAllOnBoard{"--device-over", "board", "--sensor-over", "board"};
const Arguments kInstrument{"--instrument-mm-per-v", "25"};
const Arguments kSideways{"--press-direction", "0,1,0", "--line-direction", "0,0,1"};

Arguments operator+(Arguments a, const Arguments& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class LiveKinds : public EmulatedRigProcess, public testing::WithParamInterface<LiveKind> {
 protected:
  /// What hapticctl printed last, and how it ended.
  Json identified(const Arguments& arguments) {
    ChildProcess client_process(HAPTICCTL_PROGRAM,
                                Arguments{"--server", address, "--json", "identify"} + arguments);
    const int code = client_process.wait();
    EXPECT_TRUE(code == 0 || code == 5) << code << "\n" << client_process.output() << client_process.errors();
    std::istringstream lines(client_process.output());
    Json last;
    for (std::string line; std::getline(lines, line);) last = Json::parse(line, nullptr, false);
    return last;
  }
};

double number(const Json& value) {
  return value.is_number() ? value.get<double>() : HUGE_VAL;
}

TEST_P(LiveKinds, FindItsParameter) {
  const LiveKind& kind = GetParam();
  ASSERT_NO_FATAL_FAILURE(start(kind.rig));
  client->await([](const v1::RigState& s) { return device_is(s, v1::PART_STATE_READY); });
  client->await([&](const v1::RigState&) { return bias().ok(); });
  client->await([&](const v1::RigState&) { return clear().ok(); });  // an arm is not ready before it is homed
  ASSERT_TRUE(client->load("tap_1d").ok());  // an identification is guarded as the scene before it was
  const Json end = identified(kind.identify);
  double found = NAN;
  for (const Json& parameter : end.value("parameters", Json::array())) {
    if (parameter.value("name", "") == kind.parameter) found = number(parameter["value"]);
  }
  EXPECT_GE(found, kind.low) << end.dump(2);
  EXPECT_LE(found, kind.high) << end.dump(2);
}

INSTANTIATE_TEST_SUITE_P(
    OnRigs, LiveKinds,
    testing::Values(
        LiveKind{"friction_openhaptics_netft",
                 kRub,
                 {"friction", "--object", "ball", "--tip", "rod", "--time-limit", "14"},
                 "kinetic",
                 0.1,
                 1.5},
        LiveKind{"tool_openhaptics_netft", kTurn, {"tool", "--time-limit", "10"}, "mass_g", 8.4, 10.3},
        LiveKind{"threshold_openhaptics_netft",
                 kFree,
                 {"threshold", "--duration", "5", "--time-limit", "16"},
                 "threshold_n",
                 0.003,
                 0.2},
        LiveKind{"gains_openhaptics_netft",
                 kSearch,
                 {"gains", "--time-limit", "16"},
                 "highest_holding_gain",
                 0.3,
                 2.0},
        LiveKind{"rigid_openhaptics_netft",
                 kWood,
                 {"structural", "--rigid", "--time-limit", "20"},
                 "stiffness_n_per_mm",
                 3.0,
                 4.0},
        LiveKind{"instrument_openhaptics_netft",
                 kWalls + kInstrument,
                 {"structural", "--constant", "--time-limit", "25"},
                 "stiffness_n_per_mm",
                 3.2,
                 3.8},
        LiveKind{"contact_board",
                 kPalpate + kAllOnBoard,
                 {"contact", "--object", "sponge", "--force", "3", "--time-limit", "12"},
                 "displacement_mm",
                 1.0,
                 30.0},
        LiveKind{"friction_board",
                 kRub + kAllOnBoard,
                 {"friction", "--object", "ball", "--tip", "rod", "--time-limit", "14"},
                 "kinetic",
                 0.1,
                 1.5},
        LiveKind{"tool_board", kTurn + kAllOnBoard, {"tool", "--time-limit", "10"}, "mass_g", 8.4, 10.3},
        LiveKind{"threshold_board",
                 kFree + kAllOnBoard,
                 {"threshold", "--duration", "5", "--time-limit", "16"},
                 "threshold_n",
                 0.003,
                 0.2},
        LiveKind{"gains_board",
                 kSearch + kAllOnBoard,
                 {"gains", "--time-limit", "16"},
                 "highest_holding_gain",
                 0.3,
                 2.0},
        LiveKind{"instrument_board",
                 kWalls + kAllOnBoard + kInstrument,
                 {"structural", "--constant", "--time-limit", "25"},
                 "stiffness_n_per_mm",
                 3.2,
                 3.8},
        LiveKind{"contact_openhaptics_sensor_on_board",
                 kPalpate + kSensorOnBoard,
                 {"contact", "--object", "sponge", "--force", "3", "--time-limit", "12"},
                 "displacement_mm",
                 1.0,
                 30.0},
        LiveKind{"contact_device_on_board_netft",
                 kPalpate + kDeviceOnBoard,
                 {"contact", "--object", "sponge", "--force", "3", "--time-limit", "12"},
                 "displacement_mm",
                 1.0,
                 30.0},
        LiveKind{"contact_sideways",
                 kPalpate + kSideways,
                 {"contact", "--object", "sponge", "--force", "3", "--press-direction", "0,1,0",
                  "--time-limit", "12"},
                 "displacement_mm",
                 1.0,
                 30.0},
        LiveKind{"friction_sideways",
                 kRub + kSideways,
                 {"friction", "--object", "ball", "--tip", "rod", "--press-direction", "0,1,0",
                  "--line-direction", "0,0,1", "--time-limit", "14"},
                 "kinetic",
                 0.1,
                 1.5}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace hapticd::test
