// A whole rig without hardware, for people and test rigs: an object, a hand that presses it, a PHANToM behind
// a library with the vendor's names and a Nano17 behind a Net F/T box. hapticd meets them as it would meet
// the real ones.

#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "hand_cycle.h"
#include "instructed_hand.h"
#include "rig_file.h"
#include "tests/emulators/bench/emulated_bench.h"
#include "tests/emulators/board/board_world.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/emulators/openhaptics/page.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/ticks/lateness.h"
#include "tests/support/ticks/tick_sequence.h"
#include "tests/support/turn.h"

namespace {

namespace fs = std::filesystem;
using namespace hapticd;

constexpr int kBadCommandLine = 2;

struct Options {
  std::string device = "phantom_1_0";
  std::string object = "sponge_block";
  std::string tip = "rod";
  emulators::HandTask hand;
  std::string instructions;
  std::string device_over = "openhaptics";
  std::string sensor_over = "netft";
  double instrument_mm_per_v = 0.0;
  std::vector<double> press_direction{0.0, 0.0, -1.0};
  std::vector<double> line_direction{1.0, 0.0, 0.0};
  int udp_port = 0;
  int http_port = 0;
  std::string page;
  std::string file;
  double seconds = 0.0;
  std::string conditions = "clean";
  std::vector<std::string> values;
  double drift_n_per_s = 0.0;
  std::string late_ticks;
  double tool_mass_g = 9.35;
  double vanish_every_s = 0.0;
  double slide_mm_per_s = 0.0;
  double edge_mm = 0.0;
  std::string tracker;
  double foreign_bias_every_s = 0.0;
};

/// A page that is there is gone on with: a daemon that outlived its peers still has it mapped.
std::unique_ptr<emulators::HdPage> open_page(const std::string& path) {
  if (fs::exists(path)) return std::make_unique<emulators::HdPage>(path, emulators::HdPage::Join{});
  return std::make_unique<emulators::HdPage>(path);
}

/// Lateness of each tick against even times: as recorded in a file, or "builtin": half a millisecond twice a
/// second, 5 ms every three seconds, 30 ms every ten.
std::vector<double> late_ticks_of(const std::string& text) {
  if (text == "builtin") {
    return test::lateness_us(30'000, {{500, 500.0}, {3'000, 5'000.0}, {10'000, 30'000.0}});
  }
  std::vector<double> late_us;
  const auto sequence = test::TickSequence::load(text);
  if (!sequence) throw std::runtime_error(sequence.error().text());
  double passed_us = 0.0;
  for (const sim::TickInterval& tick : sequence->ticks()) {
    passed_us += tick.interval_us;
    late_us.push_back(passed_us - 1000.0 * static_cast<double>(late_us.size() + 1));
  }
  return late_us;
}

/// NAME=VALUE, as hal/sim/README.md lists them.
std::map<std::string, double> values_of(const Options& options) {
  std::map<std::string, double> values;
  for (const std::string& text : options.values) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos) throw std::runtime_error("--condition takes NAME=VALUE, not " + text);
    values[text.substr(0, equals)] = std::stod(text.substr(equals + 1));
  }
  if (options.drift_n_per_s > 0.0) values["sensor_drift_n_per_s"] = options.drift_n_per_s;
  return values;
}

/// Whole or not at all: someone may be waiting for it.
void write_file(const std::string& path, const std::string& text) {
  const std::string draft = path + ".new";
  std::ofstream file(draft);
  file << text << std::flush;
  if (!file) throw std::runtime_error("cannot write " + draft);
  file.close();
  fs::rename(draft, path);
}

/// False when SIGINT or SIGTERM came before so long.
bool wait(const sigset_t& ending, double seconds) {
  const double whole = std::floor(seconds);
  const timespec time{static_cast<time_t>(whole), static_cast<long>(1e9 * (seconds - whole))};
  return sigtimedwait(&ending, nullptr, &time) < 0;
}

/// What a tracker sends, as rows of a file that others read while it grows.
class TrackerFile {
 public:
  TrackerFile(const std::string& path, emulators::EmulatedBench& bench) : bench_(bench) {
    if (path.empty()) return;
    file_.open(path);
    file_ << "stamp_ns,x_mm,y_mm,z_mm,qw,qx,qy,qz\n" << std::flush;
    if (!file_) throw std::runtime_error("cannot write " + path);
  }
  void go_on() {
    if (!file_.is_open()) return;
    for (const sim::TrackerPose& pose : bench_.tracker_poses()) {
      const auto& p = pose.position_mm;
      const auto& q = pose.orientation;
      file_ << fmt::format("{},{:.4f},{:.4f},{:.4f},", pose.stamp_ns, p.x, p.y, p.z);
      file_ << (pose.has_orientation ? fmt::format("{:.7f},{:.7f},{:.7f},{:.7f}\n", q.w, q.x, q.y, q.z)
                                     : ",,,\n");
    }
    file_ << std::flush;
  }

 private:
  emulators::EmulatedBench& bench_;
  std::ofstream file_;
};

/// A posture is kept beyond the way to it.
double posture_s(const sim::HandProgram& program) {
  using Kind = sim::HandProgram::Kind;
  return program.kind == Kind::kSway || program.kind == Kind::kRest ? program.hold_s : 0.0;
}

/// Waits until SIGINT or SIGTERM, or for so long; meanwhile the hand goes through its motions and the object
/// vanishes and slides as asked.
void wait_for_the_end(const sigset_t& ending, const Options& options, emulators::EmulatedBench& bench,
                      TrackerFile& tracker, const std::function<bool()>& may_begin,
                      emulators::NetFtBox* box) {
  using Kind = sim::ObjectEvent::Kind;
  constexpr double kTurnS = 0.1;
  constexpr double kSlideS = 1.0;
  constexpr double kRestS = 3.0;  // before a cycle, so that the sensor can be biased
  double next_vanish_s = options.vanish_every_s;
  double next_return_s = HUGE_VAL;
  double next_slide_s = kSlideS;
  double next_bias_s = options.foreign_bias_every_s;
  double direction = 1.0;
  const std::vector<sim::HandProgram> cycle = motions_in_turn(options.hand);
  std::size_t motion = 0;
  double next_motion_s = cycle.empty() ? HUGE_VAL : kRestS;
  std::optional<emulators::InstructedHand> person;
  if (!options.instructions.empty()) {
    person.emplace(options.instructions);
    next_motion_s = 0.0;
  }
  bool begun = false;
  for (double now_s = 0.0; options.seconds <= 0.0 || now_s < options.seconds; now_s += kTurnS) {
    if (!wait(ending, kTurnS)) return;
    tracker.go_on();
    if (!begun && !may_begin()) {
      now_s -= kTurnS;
      continue;
    }
    if (!std::exchange(begun, true)) {
      if (person) continue;
      if (const auto error = bench.set_program(single_motion(options.hand))) {
        throw std::runtime_error(error->text());
      }
    }
    if (options.vanish_every_s > 0.0 && now_s >= next_vanish_s) {
      bench.happen({.kind = Kind::kVanish});
      next_return_s = now_s + 0.5 * options.vanish_every_s;
      next_vanish_s += options.vanish_every_s;
    }
    if (now_s >= next_return_s) {
      bench.happen({.kind = Kind::kReturn});
      next_return_s = HUGE_VAL;
    }
    // What is asked for is done to its end, before anything else is; but a person lets go at once, and
    // presses when the device no longer leads.
    if (person && person->read() && person->acts_at_once()) next_motion_s = now_s;
    if (now_s >= next_motion_s) {
      const sim::HandProgram next = person ? person->next() : cycle[motion++ % cycle.size()];
      if (const auto error = bench.set_program(next)) throw std::runtime_error(error->text());
      next_motion_s = now_s + sim::planned_duration_s(next) + std::max(0.0, posture_s(next));
    }
    if (options.foreign_bias_every_s > 0.0 && box != nullptr && now_s >= next_bias_s) {
      box->bias_by_another();
      next_bias_s += options.foreign_bias_every_s;
    }
    if (options.slide_mm_per_s > 0.0 && now_s >= next_slide_s) {
      bench.happen({.kind = Kind::kMove,
                    .move_mm = {direction * kSlideS * options.slide_mm_per_s, 0.0, 0.0},
                    .duration_s = kSlideS});
      direction = -direction;
      next_slide_s += 2.0 * kSlideS;
    }
  }
}

/// How the world lies in the rig's frame; not turned if the press is the usual one.
hal::Quaternion turn_of(const Options& options) {
  const auto vector = [](const std::vector<double>& v) { return hal::Vector3{v.at(0), v.at(1), v.at(2)}; };
  const hal::Vector3 press = vector(options.press_direction);
  const hal::Vector3 line = vector(options.line_direction);
  if (!(dot(press, press) > 0.0 && dot(line, line) > 0.0))
    throw std::runtime_error("a direction has no length");
  if (dot(press, press) * dot(line, line) - dot(press, line) * dot(press, line) < 1e-6) {
    throw std::runtime_error("the line of strokes goes along the press");
  }
  return test::turn_of_world(press, line);
}

/// The world's peers, each where it is; what is on the board is shown at the end of a turn.
emulators::EmulatedBench::Peers peers_of(const emulators::BenchConfig& config, emulators::HdPage* page,
                                         emulators::NetFtBox* box, emulators::BoardWorld* board) {
  emulators::EmulatedBench::Peers peers;
  if (page != nullptr) peers = emulators::EmulatedBench::peers_of(*page, config);
  if (box != nullptr) {
    peers.load = [box](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
      box->feed(force_n, torque_n_mm);
    };
  }
  if (board == nullptr) return peers;
  if (page == nullptr) {
    peers.pose = [board](const hal::Vector3& tip_mm, const hal::Quaternion& orientation,
                         const hal::DeviceAngles&) { board->pose(tip_mm, orientation); };
    peers.force_n = [board] { return board->force_n(); };
  }
  if (box == nullptr) {
    peers.load = [board](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
      board->load(force_n, torque_n_mm);
    };
  }
  peers.instrument = [board](const hal::Vector3& tip_mm) {
    board->instrument(tip_mm);
    board->show();
  };
  return peers;
}

int run(const Options& options) {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);  // before there are threads: they inherit it

  test::TemporaryFolder folder(test::memory_folder());  // gone with the process
  const std::string page_path = options.page.empty() ? folder.path("page") : options.page;
  const bool device_on_board = options.device_over == "board";
  const bool sensor_on_board = options.sensor_over == "board";
  std::unique_ptr<emulators::HdPage> page;
  if (!device_on_board) page = open_page(page_path);
  std::unique_ptr<emulators::NetFtBox> box;
  if (!sensor_on_board) {
    emulators::NetFtBoxSettings settings;
    settings.fed = true;  // a record a turn of the world: one thread less to be late
    settings.udp_port = options.udp_port;
    settings.http_port = options.http_port;
    box = std::make_unique<emulators::NetFtBox>(settings);
  }
  constexpr hal::Vector3 kShoulderMm{-215.0, 0.0, 180.0};  // so that the hand's home is near the reset pose
  std::unique_ptr<emulators::BoardWorld> board;
  if (device_on_board || sensor_on_board || options.instrument_mm_per_v > 0.0) {
    if (*COMEDI_STAND_IN == 0)
      throw std::runtime_error("built without libcomedi: there is no board to emulate");
    emulators::ArmDescription arm{.shoulder_mm = kShoulderMm};
    board = std::make_unique<emulators::BoardWorld>(
        options.page.empty() ? folder.path("board") : page_path + ".board", arm, options.instrument_mm_per_v);
  }

  emulators::BenchConfig config;
  config.simulation.device = options.device;
  config.simulation.object = options.object;
  config.simulation.tip = options.tip;
  config.simulation.conditions = options.conditions;
  config.simulation.condition_values = values_of(options);
  config.simulation.tool_mass_g = options.tool_mass_g;
  if (options.edge_mm > 0.0) config.simulation.hold.edge_mm = options.edge_mm;
  config.truth_capacity = 1;  // it is not asked for
  if (device_on_board && options.conditions == "arm") {
    throw std::runtime_error("--conditions arm needs --device-over openhaptics: the board's arm is another");
  }
  config.turn = turn_of(options);
  std::optional<hal::Error> error;
  auto bench = emulators::EmulatedBench::create(config, peers_of(config, page.get(), box.get(), board.get()));
  if (!bench) {
    error = bench.error();
  } else {
    error = (*bench)->set_program(single_motion(options.hand));  // refused before there is a rig file
  }
  if (error) {
    std::fprintf(stderr, "hapticd_emulated_rig: %s\n", error->text().c_str());
    return 2;
  }
  // An arm on the board is homed before the hand moves it.
  const auto may_begin = [&] { return !device_on_board || board->is_awake(); };
  if (device_on_board) (void)(*bench)->set_program({});
  TrackerFile tracker(options.tracker, **bench);
  const hal::RigInfo& rig = (*bench)->info();
  if (page) {
    page->set_late_ticks(options.late_ticks.empty() ? std::vector<double>{}
                                                    : late_ticks_of(options.late_ticks));
    page->device().max_force_n = rig.device.max_force_n;
    page->device().max_continuous_force_n = rig.device.max_continuous_force_n;
  }
  (*bench)->start();

  emulators::RigPeers peers{.box = box.get(),
                            .page = page.get(),
                            .board = board.get(),
                            .instrument_mm_per_v = options.instrument_mm_per_v,
                            .shoulder_mm = kShoulderMm};
  if (sensor_on_board) {
    peers.calibration_file = folder.write("sensor.cal", board->gauges().calibration_file({}));
  }
  const std::string text = rig_file(peers, rig);
  if (options.file.empty()) {
    std::fputs(text.c_str(), stdout);
  } else {
    write_file(options.file, text);
    // For scripts and people: what to start, ready to be pasted.
    std::printf("%s\n", daemon_command(peers, options.file).c_str());
  }
  std::fflush(stdout);
  wait_for_the_end(ending, options, **bench, tracker, may_begin, box.get());
  (*bench)->stop();
  const test::FreeAirJudge& free_air = (*bench)->free_air();
  std::fprintf(
      stderr,
      "hapticd_emulated_rig: %.1f s in free air; force asked there: at most %.3f N, %.1f ms at a stretch "
      "above %.2f N\n",
      free_air.free_s(), free_air.max_n(), free_air.longest_ms(), test::FreeAirJudge::kZeroN);
  std::fprintf(stderr, "hapticd_emulated_rig: the world stood still for at most %.1f ms\n",
               (*bench)->longest_pause_ms());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(
      "A rig without hardware that hapticd takes for a real one: device behind a library with the vendor's "
      "names, sensor behind a Net F/T box on 127.0.0.1, and a hand that presses an object.",
      "hapticd_emulated_rig");
  app.option_defaults()->always_capture_default();
  app.add_option("--device", options.device, "Simulated device: phantom_1_0, phantom_1_5_high_force");
  app.add_option("--object", options.object, "Simulated object, or none");
  app.add_option("--tip", options.tip, "rod, ball_bearing");
  app.add_option("--program", options.hand.program, "What the hand does, again and again")
      ->check(CLI::IsMember(emulators::hand_programs()));
  app.add_option(
         "--instructions", options.instructions,
         "The hand does what an identification asks for, by the words that 'hapticctl --json identify "
         "... > FILE' writes; instead of --program")
      ->type_name("FILE");
  app.add_option("--force-n", options.hand.force_n, "Force of a press [N]");
  app.add_option("--hold-s", options.hand.hold_s, "How long it is held [s]; negative = for ever");
  app.add_option(
         "--device-over", options.device_over,
         "The device behind the vendor's library or an analog board (comedi's library preloaded); on a "
         "board the hand waits until a daemon has homed the arm")
      ->check(CLI::IsMember({"openhaptics", "board"}));
  app.add_option("--sensor-over", options.sensor_over, "The force sensor behind a Net F/T box or the board")
      ->check(CLI::IsMember({"netft", "board"}));
  app.add_option("--instrument-mm-per-v", options.instrument_mm_per_v,
                 "An instrument on the board sees where the tip really is; 0 = none")
      ->check(CLI::Range(0.0, 1000.0));
  app.add_option("--press-direction", options.press_direction,
                 "The world is turned so that the hand presses along this")
      ->expected(3)
      ->delimiter(',');
  app.add_option("--line-direction", options.line_direction, "and strokes along this, as far as it is across")
      ->expected(3)
      ->delimiter(',');
  app.add_option("--udp-port", options.udp_port, "Of the box; 0 = any free one")->check(CLI::Range(0, 65535));
  app.add_option("--http-port", options.http_port, "Of the box; 0 = any free one")
      ->check(CLI::Range(0, 65535));
  app.add_option("--page", options.page,
                 "File shared with the library, best in memory (/dev/shm); is gone on with where it exists")
      ->type_name("FILE");
  app.add_option("--write", options.file, "Where the rig file goes; else to standard output")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "End after so long; 0 = on SIGINT or SIGTERM");
  app.add_option(
         "--conditions", options.conditions,
         "clean; lab: drift, vibration and the like; arm: one that was never calibrated, and a tracker")
      ->check(CLI::IsMember({"clean", "lab", "arm"}));
  app.add_option("--condition", options.values, "One of them by name, over the preset; again for more")
      ->type_name("NAME=VALUE");
  app.add_option("--drift-n-per-s", options.drift_n_per_s, "Of the sensor's zero, each axis")
      ->check(CLI::Range(0.0, 0.01));
  app.add_option("--late-ticks", options.late_ticks,
                 "The device's scheduler is late: as in FILE.csv (interval_us, sensor_records), or builtin")
      ->type_name("FILE|builtin");
  app.add_option("--tool-mass-g", options.tool_mass_g, "Beyond the sensor")->check(CLI::Range(0.0, 500.0));
  app.add_option("--foreign-bias-every-s", options.foreign_bias_every_s,
                 "Another client biases the Net F/T box so often, whatever it bears; 0 = never");
  app.add_option("--vanish-every-s", options.vanish_every_s,
                 "The object vanishes so often and is back after half of that; 0 = never");
  app.add_option("--slide-mm-per-s", options.slide_mm_per_s,
                 "The object slides along x and back; 0 = it rests");
  app.add_option(
         "--tracker", options.tracker,
         "Where what a tracker sees of the tool goes, as it is seen; needs tracker_rate_hz, as of arm")
      ->type_name("FILE");
  app.add_option("--edge-mm", options.edge_mm, "Where the object ends along x; 0 = nowhere");
  app.footer(
      "Example:\n"
      "  hapticd_emulated_rig --object sponge_block --force-n 2 --write rig.toml &\n"
      "  (prints the line that starts hapticd on it, e.g.)\n"
      "  HD_STAND_IN_PAGE=/tmp/hapticd-emulated-x/page hapticd --config rig.toml --scene tap_1d");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadCommandLine;
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hapticd_emulated_rig: %s\n", error.what());
    return 1;
  }
}
