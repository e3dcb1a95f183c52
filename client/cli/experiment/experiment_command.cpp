#include <fmt/core.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"

namespace hapticd::cli {
namespace {

namespace fs = std::filesystem;

/// Debian's, for which the package is made.
constexpr const char* kPython = "/usr/bin/python3";

constexpr const char* kRemedy =
    "install it: package python3-hapticd (deploy/package.sh makes it), a wheel, or cmake --install of a "
    "build with "
    "python3-protobuf; see docs/tutorial_python.md";

constexpr const char* kProgram =
    "import importlib.util, sys\n"
    "remedy = sys.argv.pop(1)\n"
    "if importlib.util.find_spec('hapticd') is None:\n"
    "    print('hapticctl: the Python package hapticd is not installed; ' + remedy, file=sys.stderr)\n"
    "    sys.exit(2)\n"
    "from hapticd.experiment.__main__ import main\n"
    "sys.exit(main())\n";

/// Finds the package next to the programs in the folder of a build, or where cmake --install puts it under a
/// prefix.
void find_own_package() {
  std::error_code failure;
  const fs::path above = fs::read_symlink("/proc/self/exe", failure).parent_path().parent_path();
  if (failure) return;
  for (const fs::path& package : {above / "python", above / "lib/python3/dist-packages"}) {
    if (!fs::exists(package / "hapticd" / "__init__.py", failure)) continue;
    const char* more = std::getenv("PYTHONPATH");
    setenv("PYTHONPATH", (package.string() + (more ? std::string(":") + more : "")).c_str(), 1);
    return;
  }
}

/// Hands over to the Python package, whose exit code is that of the command.
[[noreturn]] void hand_over(const Session& session, const std::string& command,
                            const std::vector<std::string>& arguments) {
  find_own_package();
  setenv("HAPTICD_SERVER", session.server.c_str(), 1);
  if (session.json) setenv("HAPTICD_JSON", "1", 1);
  if (!session.certificates.empty()) setenv("HAPTICD_CERTIFICATES", session.certificates.c_str(), 1);
  std::vector<std::string> words{kPython, "-c", kProgram, kRemedy, command};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  execv(kPython, pointers.data());
  throw LocalError("it cannot be started", kPython, std::strerror(errno), "", "apt install python3");
}

}  // namespace

void add_experiment_command(CLI::App& app, Session& session) {
  CLI::App* experiment =
      app.add_subcommand("experiment", "Perception experiments, from a protocol file to estimates");
  experiment->require_subcommand(1);
  const auto add = [&](const char* name, const char* description, const char* example) {
    CLI::App* command = experiment->add_subcommand(name, description);
    command->set_help_flag();  // the package's own
    command->fallthrough(false);
    command->prefix_command();
    command->footer(fmt::format("Example:\n  hapticctl experiment {} {}", name, example));
    command->callback([&session, command, name] { hand_over(session, name, command->remaining()); });
  };
  add("check", "What a protocol asks for, and whether this rig can do it", "stiffness_1d");
  add("run", "A participant's session, at a page in the browser",
      "stiffness_1d --participant P01 --folder sessions");
  add("resume", "Goes on with a session that was ended or died", "sessions/stiffness_1d_P01.jsonl");
  add("simulate", "Simulated participants, on a rig or without one",
      "stiffness_1d --participants 8 --folder pilot");
  add("scan", "From a recording of touches to a virtual object of that shape",
      "scan.mcap --step 5 --out surface.toml");
  add("analyse", "Estimates and figures of a folder of sessions", "sessions --figures figures");
  add("export", "A folder of sessions as BIDS or CSV", "sessions --out dataset");
  experiment->footer(
      "Each has its own --help. They need the Python package hapticd.\n\n"
      "Examples:\n"
      "  hapticctl experiment check stiffness_1d\n"
      "  hapticctl experiment simulate stiffness_1d --participants 8 --folder pilot\n"
      "  hapticctl experiment analyse pilot");
}

}  // namespace hapticd::cli
