#include "tests/measure/bench/live/daemon_process.h"

#include <csignal>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace hapticd::bench {
namespace {

constexpr std::chrono::seconds kTimeout{20};

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// The address of the line "hapticd listens on ADDRESS"; empty while it is not there.
std::string announced_address(const std::string& log) {
  constexpr std::string_view kAnnouncement = "hapticd listens on ";
  const std::size_t begin = log.find(kAnnouncement);
  if (begin == std::string::npos) return {};
  const std::size_t end = log.find('\n', begin);
  if (end == std::string::npos) return {};
  return log.substr(begin + kAnnouncement.size(), end - begin - kAnnouncement.size());
}

std::string configuration_beside(std::filesystem::path log, const DaemonSetup& setup) {
  const std::filesystem::path file = log.replace_extension(".toml");
  std::ofstream(file) << "[loop]\ncpu = " << setup.loop_cpu << "\nrate_hz = " << setup.rate_hz << '\n'
                      << setup.more_configuration;
  return file.string();
}

std::vector<std::string> command_of(const std::filesystem::path& log, const DaemonSetup& setup) {
  std::vector<std::string> command;
  if (setup.max_descriptors > 0) {
    const std::string limit = std::to_string(setup.max_descriptors);
    command = {"prlimit", "--nofile=" + limit + ":" + limit};
  }
  command.insert(command.end(), {(program_folder() / "hapticd").string(), "--rig", "sim", "--scene",
                                 setup.scene, "--listen", "127.0.0.1:0", "--model-store", setup.model_store,
                                 "--config", configuration_beside(log, setup)});
  return command;
}

}  // namespace

std::filesystem::path program_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

DaemonProcess::DaemonProcess(std::filesystem::path log, const DaemonSetup& setup)
    : log_(std::move(log)), process_({.command = command_of(log_, setup), .output = log_}) {
  const auto deadline = std::chrono::steady_clock::now() + kTimeout;
  while (address_.empty()) {
    const auto status = process_.wait(std::chrono::milliseconds(20));
    address_ = announced_address(content(log_));
    if (status)
      throw std::runtime_error("hapticd ended with status " + std::to_string(*status) + ": " + content(log_));
    if (address_.empty() && std::chrono::steady_clock::now() > deadline) {
      throw std::runtime_error("hapticd did not say where it listens: " + content(log_));
    }
  }
}

int DaemonProcess::stop() {
  process_.signal(SIGTERM);
  return process_.wait(std::chrono::seconds(10)).value_or(-1);
}

}  // namespace hapticd::bench
