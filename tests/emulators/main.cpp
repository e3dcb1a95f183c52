// A whole rig without hardware, for people and test rigs: an object, a hand that presses it, a PHANToM behind
// a library with the vendor's names and a Nano17 behind a Net F/T box. hapticd meets them as it would meet
// the real ones.

#include <fmt/format.h>
#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "tests/emulators/bench/emulated_bench.h"
#include "tests/emulators/netft/netft_box.h"
#include "tests/emulators/openhaptics/page.h"

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
};

/// Where the page is if nobody says; gone with the process.
class OwnFolder {
 public:
  OwnFolder() {
    std::string name = (fs::temp_directory_path() / "hapticd-emulated-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~OwnFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
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
  return program;
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

/// Until SIGINT or SIGTERM, or for so long.
void wait_for_the_end(const sigset_t& ending, double seconds) {
  int signal_number = 0;
  if (seconds <= 0.0) {
    sigwait(&ending, &signal_number);
    return;
  }
  const double whole = std::floor(seconds);
  const timespec time{static_cast<time_t>(whole), static_cast<long>(1e9 * (seconds - whole))};
  sigtimedwait(&ending, nullptr, &time);
}

int run(const Options& options) {
  sigset_t ending;
  sigemptyset(&ending);
  sigaddset(&ending, SIGTERM);
  sigaddset(&ending, SIGINT);
  pthread_sigmask(SIG_BLOCK, &ending, nullptr);  // before there are threads: they inherit it

  std::unique_ptr<OwnFolder> folder;
  if (options.page.empty()) folder = std::make_unique<OwnFolder>();
  const auto page = open_page(folder ? (folder->path() / "page").string() : options.page);

  emulators::NetFtBoxSettings settings;
  settings.udp_port = options.udp_port;
  settings.http_port = options.http_port;
  emulators::NetFtBox box(settings);

  emulators::BenchConfig config;
  config.simulation.device = options.device;
  config.simulation.object = options.object;
  config.simulation.tip = options.tip;
  config.truth_capacity = 1;  // nobody asks for it
  auto bench = emulators::EmulatedBench::create(
      config, *page, [&box](const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
        box.load(force_n, torque_n_mm);
      });
  std::optional<hal::Error> error;
  if (!bench) {
    error = bench.error();
  } else {
    error = (*bench)->set_program(program_of(options));
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
  wait_for_the_end(ending, options.seconds);
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
      ->check(CLI::IsMember({"press", "tap", "rest"}));
  app.add_option("--force-n", options.force_n, "Force of a press [N]");
  app.add_option("--hold-s", options.hold_s, "How long it is held [s]; negative = for ever");
  app.add_option("--udp-port", options.udp_port, "Of the box; 0 = any free one")->check(CLI::Range(0, 65535));
  app.add_option("--http-port", options.http_port, "Of the box; 0 = any free one")
      ->check(CLI::Range(0, 65535));
  app.add_option("--page", options.page, "File shared with the library; is gone on with where it exists")
      ->type_name("FILE");
  app.add_option("--write", options.file, "Where the rig file goes; else to standard output")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "End after so long; 0 = on SIGINT or SIGTERM");
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
