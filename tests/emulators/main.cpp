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
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hal/sim/tick_sequence.h"
#include "tests/emulators/bench/emulated_bench.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/emulators/openhaptics/page.h"
#include "tests/support/temporary_folder.h"

namespace {

namespace fs = std::filesystem;
using namespace hapticd;

struct Options {
  std::string device = "phantom_1_0";
  std::string object = "sponge_block";
  std::string tip = "rod";
  std::string program = "press";
  double force_n = 2.0;
  double hold_s = 2.0;
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
};

/// A page that is there is gone on with: a daemon that outlived its peers still has it mapped.
std::unique_ptr<emulators::HdPage> open_page(const std::string& path) {
  if (fs::exists(path)) return std::make_unique<emulators::HdPage>(path, emulators::HdPage::Join{});
  return std::make_unique<emulators::HdPage>(path);
}

sim::HandProgram program_of(const Options& options) {
  sim::HandProgram program;
  program.repetitions = -1;
  program.force_n = options.force_n;
  program.hold_s = options.hold_s;
  if (options.program == "press") program.kind = sim::HandProgram::Kind::kPress;
  if (options.program == "tap") program.kind = sim::HandProgram::Kind::kTap;
  if (options.program == "wave") {  // ±20 mm at 2.2 Hz, well above the object
    program.kind = sim::HandProgram::Kind::kSway;
    program.rate_hz = 2.2;
    program.speed_mm_per_s = 276.0;
    program.hold_s = -1.0;
    program.place_mm = {0.0, 0.0, 60.0};
  }
  if (options.program == "dart") {  // the tool, on the spring of the hand: 400 mm/s, 20 m/s²
    program.speed_mm_per_s = 330.0;
    program.acceleration_m_per_s2 = 16.5;
    program.kind = sim::HandProgram::Kind::kDart;
    program.rate_hz = 1.0;
    program.stroke_length_mm = 60.0;
    program.hold_s = -1.0;
    program.grip_stiffness_scale = 2.0;
    program.grip_damping_scale = 4.0;
    program.place_mm = {0.0, 0.0, 20.0};
  }
  return program;
}

/// What a person does whom an identification asks: one motion after the other, again and again. Empty for the
/// programs of a single motion.
std::vector<sim::HandProgram> cycle_of(const Options& options) {
  using Kind = sim::HandProgram::Kind;
  constexpr double kTravelS = 1.0;
  std::vector<sim::HandProgram> cycle;
  const auto add = [&cycle](Kind kind) -> sim::HandProgram& {
    sim::HandProgram& program = cycle.emplace_back();
    program.kind = kind;
    program.travel_s = kTravelS;
    program.approach_mm_per_s = 40.0;
    return program;
  };
  if (options.program == "palpate") {
    for (const double share : {0.3, 0.65, 1.0}) {
      for (const double over_s : {1.5, 0.4, 0.1}) {
        sim::HandProgram& press = add(Kind::kPress);
        press.force_n = share * options.force_n;
        press.force_rate_n_per_s = press.force_n / over_s;
        press.hold_s = options.hold_s;
      }
      sim::HandProgram& taps = add(Kind::kTap);
      taps.speed_mm_per_s = 100.0 + 150.0 * share;
      taps.repetitions = 3;
    }
  }
  if (options.program == "rub") {
    constexpr double kLineMm = 30.0;
    constexpr double kBeyondMm = 8.0;
    for (int i = 0; i < 2; ++i) {
      sim::HandProgram& scan = add(Kind::kScan);
      scan.place_mm.x = -0.5 * kLineMm - kBeyondMm;
      scan.stroke_length_mm = kLineMm + 2.0 * kBeyondMm;
      scan.repetitions = 20;
      scan.speed_mm_per_s = 40.0;
    }
    for (const double speed_mm_per_s : {110.0, 60.0}) {
      for (const double force_n : {1.2, 3.0, 5.0}) {
        sim::HandProgram& stroke = add(Kind::kStroke);
        stroke.force_n = force_n;
        stroke.force_rate_n_per_s = 6.0;
        stroke.speed_mm_per_s = speed_mm_per_s;
        stroke.stroke_length_mm = kLineMm;
        stroke.repetitions = 4;
      }
    }
  }
  if (options.program == "turn") {
    for (const double tilt_deg : {45.0, 20.0}) {
      sim::HandProgram& sway = add(Kind::kSway);
      sway.tilt_deg = tilt_deg;
      sway.rate_hz = 1.2;
      sway.speed_mm_per_s = 150.0;
      sway.hold_s = 6.0;
      sway.place_mm.z = 80.0;
    }
  }
  return cycle;
}

/// By how much later than even each tick is: as recorded in a file, or "builtin": half a millisecond twice a
/// second, 5 ms every three seconds, 30 ms every ten.
std::vector<double> late_ticks_of(const std::string& text) {
  std::vector<double> late_us;
  if (text == "builtin") {
    late_us.assign(30'000, 0.0);
    for (std::size_t i = 499; i < late_us.size(); i += 500) late_us[i] = 500.0;
    for (std::size_t i = 2999; i < late_us.size(); i += 3000) late_us[i] = 5000.0;
    for (std::size_t i = 9999; i < late_us.size(); i += 10'000) late_us[i] = 30'000.0;
    // Those that could not be in time either.
    for (std::size_t i = 1; i < late_us.size(); ++i)
      late_us[i] = std::max(late_us[i], late_us[i - 1] - 1000.0);
    return late_us;
  }
  const auto sequence = sim::TickSequence::load(text);
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

std::string quoted(const std::string& text) {
  std::string toml = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') toml += '\\';
    toml += c;
  }
  return toml + "\"";
}

/// A decimal point or an exponent in any case: to TOML a number without is a whole one.
std::string number(double value) {
  const std::string text = fmt::format("{:.10g}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string rig_file(const emulators::NetFtBox& box, const emulators::HdPage& page, const hal::RigInfo& rig) {
  const std::string page_path = fs::absolute(page.path()).string();
  return fmt::format(
      "# An emulated rig: alive as long as process {} is. The library finds its world through the "
      "environment:\n"
      "#   HD_STAND_IN_PAGE='{}' hapticd --config THIS_FILE\n"
      "[rig]\nkind = \"hardware\"\ndevice = \"openhaptics\"\nsensor = \"netft\"\n\n"
      "[rig.openhaptics]\nlibrary = {}\nstructural_stiffness_n_per_mm = {}\napparent_mass_g = {}\n"
      "position_resolution_mm = {}\n\n"
      "[rig.netft]\naddress = \"127.0.0.1\"\nrdt_port = {}\nhttp_port = {}\nmodel = \"nano17_si_25\"\n"
      "tool_mass_g = {}\nfifo_priority = 0  # its peer runs on this machine too\n",
      getpid(), page_path, quoted(STAND_IN_LIBRARY), number(rig.device.structural_stiffness_n_per_mm),
      number(rig.device.apparent_mass_g), number(rig.device.position_resolution_mm), box.udp_port(),
      box.http_port(), number(rig.sensor.tool_mass_g));
}

/// Whole or not at all: somebody may be waiting for it.
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

/// A posture is kept beyond the way to it.
double posture_s(const sim::HandProgram& program) {
  return program.kind == sim::HandProgram::Kind::kSway ? program.hold_s : 0.0;
}

/// Until SIGINT or SIGTERM, or for so long; meanwhile the hand goes through its motions and the object
/// vanishes and slides as asked.
void wait_for_the_end(const sigset_t& ending, const Options& options, emulators::EmulatedBench& bench) {
  using Kind = sim::ObjectEvent::Kind;
  constexpr double kTurnS = 0.1;
  constexpr double kSlideS = 1.0;
  double next_vanish_s = options.vanish_every_s;
  double next_return_s = HUGE_VAL;
  double next_slide_s = kSlideS;
  double direction = 1.0;
  const std::vector<sim::HandProgram> cycle = cycle_of(options);
  std::size_t motion = 0;
  double next_motion_s = cycle.empty() ? HUGE_VAL : 0.0;
  for (double now_s = 0.0; options.seconds <= 0.0 || now_s < options.seconds; now_s += kTurnS) {
    if (!wait(ending, kTurnS)) return;
    if (options.vanish_every_s > 0.0 && now_s >= next_vanish_s) {
      bench.happen({.kind = Kind::kVanish});
      next_return_s = now_s + 0.5 * options.vanish_every_s;
      next_vanish_s += options.vanish_every_s;
    }
    if (now_s >= next_return_s) {
      bench.happen({.kind = Kind::kReturn});
      next_return_s = HUGE_VAL;
    }
    if (now_s >= next_motion_s) {
      const sim::HandProgram& next = cycle[motion++ % cycle.size()];
      if (const auto error = bench.set_program(next)) throw std::runtime_error(error->text());
      next_motion_s = now_s + sim::planned_duration_s(next) + std::max(0.0, posture_s(next));
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

int run(const Options& options) {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);  // before there are threads: they inherit it

  std::unique_ptr<test::TemporaryFolder> folder;  // gone with the process
  if (options.page.empty()) folder = std::make_unique<test::TemporaryFolder>(test::memory_folder());
  const auto page = open_page(folder ? folder->path("page") : options.page);

  emulators::NetFtBoxSettings settings;
  settings.udp_port = options.udp_port;
  settings.http_port = options.http_port;
  emulators::NetFtBox box(settings);

  emulators::BenchConfig config;
  config.simulation.device = options.device;
  config.simulation.object = options.object;
  config.simulation.tip = options.tip;
  config.simulation.conditions = options.conditions;
  config.simulation.condition_values = values_of(options);
  config.simulation.tool_mass_g = options.tool_mass_g;
  if (options.edge_mm > 0.0) config.simulation.hold.edge_mm = options.edge_mm;
  config.truth_capacity = 1;  // nobody asks for it
  page->set_late_ticks(options.late_ticks.empty() ? std::vector<double>{}
                                                  : late_ticks_of(options.late_ticks));
  auto bench = emulators::EmulatedBench::create(
      config, *page, [&box](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
        box.load(force_n, torque_n_mm);
      });
  std::optional<hal::Error> error;
  if (!bench) {
    error = bench.error();
  } else {
    error = (*bench)->set_program(program_of(options));  // at rest where a cycle follows
  }
  if (error) {
    std::fprintf(stderr, "hapticd_emulated_rig: %s\n", error->text().c_str());
    return 2;
  }
  const hal::RigInfo& rig = (*bench)->info();
  page->device().max_force_n = rig.device.max_force_n;
  page->device().max_continuous_force_n = rig.device.max_continuous_force_n;
  (*bench)->start();

  const std::string text = rig_file(box, *page, rig);
  if (options.file.empty()) {
    std::fputs(text.c_str(), stdout);
  } else {
    write_file(options.file, text);
    // For scripts and people: what to start, ready to be pasted.
    std::printf("HD_STAND_IN_PAGE='%s' hapticd --config '%s'\n", fs::absolute(page->path()).string().c_str(),
                options.file.c_str());
  }
  std::fflush(stdout);
  wait_for_the_end(ending, options, **bench);
  (*bench)->stop();
  const test::FreeAirJudge& free_air = (*bench)->free_air();
  std::fprintf(
      stderr,
      "hapticd_emulated_rig: %.1f s in free air; force asked there: at most %.3f N, %.1f ms at a stretch "
      "above %.2f N\n",
      free_air.free_s(), free_air.max_n(), free_air.longest_ms(), test::FreeAirJudge::kZeroN);
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
  app.add_option("--program", options.program, "What the hand does, again and again")
      ->check(CLI::IsMember({"press", "tap", "rest", "wave", "dart", "palpate", "rub", "turn"}));
  app.add_option("--force-n", options.force_n, "Force of a press [N]");
  app.add_option("--hold-s", options.hold_s, "How long it is held [s]; negative = for ever");
  app.add_option("--udp-port", options.udp_port, "Of the box; 0 = any free one")->check(CLI::Range(0, 65535));
  app.add_option("--http-port", options.http_port, "Of the box; 0 = any free one")
      ->check(CLI::Range(0, 65535));
  app.add_option("--page", options.page,
                 "File shared with the library, best in memory (/dev/shm); is gone on with where it exists")
      ->type_name("FILE");
  app.add_option("--write", options.file, "Where the rig file goes; else to standard output")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "End after so long; 0 = on SIGINT or SIGTERM");
  app.add_option("--conditions", options.conditions, "clean, or lab: drift, vibration and the like")
      ->check(CLI::IsMember({"clean", "lab"}));
  app.add_option("--condition", options.values, "One of them by name, over the preset; again for more")
      ->type_name("NAME=VALUE");
  app.add_option("--drift-n-per-s", options.drift_n_per_s, "Of the sensor's zero, each axis")
      ->check(CLI::Range(0.0, 0.01));
  app.add_option("--late-ticks", options.late_ticks,
                 "The device's scheduler is late: as in FILE.csv (interval_us, sensor_records), or builtin")
      ->type_name("FILE|builtin");
  app.add_option("--tool-mass-g", options.tool_mass_g, "Beyond the sensor")->check(CLI::Range(0.0, 500.0));
  app.add_option("--vanish-every-s", options.vanish_every_s,
                 "The object vanishes so often and is back after half of that; 0 = never");
  app.add_option("--slide-mm-per-s", options.slide_mm_per_s,
                 "The object slides along x and back; 0 = it rests");
  app.add_option("--edge-mm", options.edge_mm, "Where the object ends along x; 0 = nowhere");
  app.footer(
      "Example:\n"
      "  hapticd_emulated_rig --object sponge_block --force-n 2 --write rig.toml &\n"
      "  (prints the line that starts hapticd on it, e.g.)\n"
      "  HD_STAND_IN_PAGE=/tmp/hapticd-emulated-x/page hapticd --config rig.toml --scene tap_1d");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hapticd_emulated_rig: %s\n", error.what());
    return 1;
  }
}
