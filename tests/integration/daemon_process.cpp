#include "tests/integration/daemon_process.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <utility>

namespace hapticd::test {

namespace {
/// A test leaves nothing in the home of the one who runs it.
std::vector<std::string> without_store(std::vector<std::string> arguments) {
  if (std::find(arguments.begin(), arguments.end(), "--model-store") == arguments.end()) {
    arguments.insert(arguments.end(), {"--model-store", ":memory:"});
  }
  return arguments;
}
std::vector<std::string> limited(const std::string& limit, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {limit, HAPTICD_BINARY});
  return arguments;
}
std::string of_descriptors(int max) {
  return "--nofile=" + std::to_string(max) + ":" + std::to_string(max);
}
}  // namespace

DaemonProcess::DaemonProcess(std::vector<std::string> arguments)
    : ChildProcess(HAPTICD_BINARY, without_store(std::move(arguments))) {}

DaemonProcess::DaemonProcess(std::vector<std::string> arguments, int max_descriptors)
    : DaemonProcess(of_descriptors(max_descriptors), std::move(arguments)) {}

DaemonProcess::DaemonProcess(const std::string& limit, std::vector<std::string> arguments)
    : ChildProcess("/usr/bin/prlimit", limited(limit, without_store(std::move(arguments)))) {}

std::string DaemonProcess::await_address() {
  const std::string line = read_line();
  const std::string before = "hapticd listens on ";
  if (line.starts_with(before)) return line.substr(before.size());
  wait();
  ADD_FAILURE() << "it does not listen: " << errors();
  return {};
}

void DaemonProcess::end() {
  signal(SIGTERM);
  EXPECT_EQ(wait(), 0) << errors();
}

std::string subscriber_binary() {
  return SUBSCRIBER_BINARY;
}

}  // namespace hapticd::test
