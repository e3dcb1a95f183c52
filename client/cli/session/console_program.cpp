#include "client/cli/session/console_program.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <string_view>
#include <vector>

#include "client/cli/session/own_program.h"

extern char** environ;

namespace hapticd::cli {

namespace {

constexpr std::string_view kLine = "hapticd-console listens on ";

LocalError cannot_start(const std::string& why) {
  return LocalError("the console does not start: " + why, "hapticd-console", "", "",
                    "install it (package hapticd-console), or start the rig's own: systemctl start "
                    "hapticd-console");
}

std::string first_line_of(int descriptor) {
  std::string line;
  char c = 0;
  while (read(descriptor, &c, 1) == 1 && c != '\n') line += c;
  return line;
}

}  // namespace

std::string start_console_program(const Session& session) {
  std::vector<std::string> words{
      own_program("hapticd-console"), "--personal", "--server", session.server, "--listen", "127.0.0.1:0"};
  if (!session.certificates.empty()) words.insert(words.end(), {"--certificates", session.certificates});
  std::vector<char*> arguments = argument_pointers(words);

  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw cannot_start(std::strerror(errno));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);  // the end of this terminal is not its end
  pid_t child = 0;
  const int failure = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  close(ends[1]);
  const std::string line = failure == 0 ? first_line_of(ends[0]) : std::string();
  close(ends[0]);
  if (failure != 0) throw cannot_start(std::strerror(failure));
  if (line.starts_with(kLine)) return line.substr(kLine.size());
  int status = 0;
  waitpid(child, &status, 0);
  throw cannot_start("it said why above");
}

}  // namespace hapticd::cli
