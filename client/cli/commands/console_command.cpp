#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "client/cli/commands/commands.h"
#include "client/cli/text/message_json.h"

extern char** environ;

namespace hapticd::cli {

namespace {

struct ConsoleOptions {
  bool only_print = false;
};

bool has_screen() {
  return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr;
}

/// A page, readable by its owner alone, that leads to the address: as an argument other users could read it.
std::string page_to(const std::string& url) {
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  std::string path = std::string(folder == nullptr ? "/tmp" : folder) + "/hapticd_console_XXXXXX.html";
  const int file = mkstemps(path.data(), 5);
  if (file < 0) return {};
  const std::string text =
      "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=" + url + "\">\n";
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(file);
  if (written) return path;
  unlink(path.c_str());
  return {};
}

bool open_browser(const std::string& url) {
  // An address without a key is no secret.
  std::string target = url.find("key=") == std::string::npos ? url : page_to(url);
  if (target.empty()) return false;
  std::string program = "xdg-open";
  char* arguments[] = {program.data(), target.data(), nullptr};
  pid_t child = 0;
  if (posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments, environ) != 0) return false;
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

void add_console_command(CLI::App& app, Session& session) {
  auto options = std::make_shared<ConsoleOptions>();
  CLI::App* command =
      app.add_subcommand("console", "Open the page of the rig in a browser, signed in as you");
  command->add_flag("--print", options->only_print, "Print its address, which works once, within a minute");
  command->footer("Examples:\n  hapticctl console\n  hapticctl console --print");
  command->callback([&session, options] {
    const std::string url = session.connect().open_console().url();
    if (session.json) return print_json(Json{{"url", url}});
    if (!options->only_print && has_screen() && open_browser(url)) {
      fmt::print("the console is open in the browser\n");
      return;
    }
    fmt::print("{}\n", url);
  });
}

}  // namespace hapticd::cli
