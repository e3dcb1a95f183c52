#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <regex>
#include <string>
#include <string_view>

#include "client/cli/commands/commands.h"
#include "client/cli/session/console_program.h"
#include "client/cli/session/print.h"
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

/// Checks the address, which comes from the daemon. A browser opens it, so it must be a page of the web, in
/// the letters of an address only: any other scheme could start another program, any other letter end the tag
/// of page_to().
void check_address(const std::string& url) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~:/?#[]@!$*+,;=%&";
  const bool is_page = url.starts_with("http://") || url.starts_with("https://");
  if (is_page && url.find_first_not_of(kLetters) == std::string::npos) return;
  throw LocalError("the daemon gave no address of a page", "console", url, "http://… or https://…",
                   "see whether the daemon is the one that you mean: hapticctl status");
}

/// Makes a page, readable by its owner alone, that leads to the address: as an argument other users could
/// read it.
std::string page_to(const std::string& url) {
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  std::string path = std::string(folder == nullptr ? "/tmp" : folder) + "/hapticd_console_XXXXXX.html";
  const int file = mkstemps(path.data(), 5);
  if (file < 0) return {};
  const std::string text =
      "<!doctype html><meta charset=\"utf-8\"><meta http-equiv=\"refresh\" content=\"0;url=" +
      std::regex_replace(url, std::regex("&"), "&amp;") + "\">\n";
  const bool written = write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  close(file);
  if (written) return path;
  unlink(path.c_str());
  return {};
}

/// The address of the rig's console, or of one that is started for this user.
std::string console_url(const Session& session) {
  try {
    return session.connect().open_console().url();
  } catch (const client::Error& error) {
    if (error.code() != "FAILED_PRECONDITION") throw;
  }
  return start_console_program(session);
}

bool open_browser(const std::string& url) {
  // An address without a key is not secret.
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
  CLI::App* command = app.add_subcommand("console",
                                         "Open the page of the rig in a browser, signed in as you; starts "
                                         "hapticd-console where the rig has none");
  command->add_flag("--print", options->only_print, "Print its address, which works once, within a minute");
  command->footer("Examples:\n  hapticctl console\n  hapticctl console --print");
  command->callback([&session, options] {
    const std::string url = console_url(session);
    check_address(url);
    if (session.json) return print_json(Json{{"url", url}});
    if (!options->only_print && has_screen() && open_browser(url)) {
      print_line("the console is open in the browser");
      return;
    }
    print_line(url);
  });
}

}  // namespace hapticd::cli
