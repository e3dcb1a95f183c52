#pragma once

#include <filesystem>
#include <string>

#include "client/cpp/client.h"
#include "tests/measure/bench/live/daemon_process.h"

namespace hapticd::bench {

/// Certificates of a server and of one operator, made in `folder`. Throws std::runtime_error.
void make_lab(const std::filesystem::path& folder);

/// A daemon to be attacked: it listens by every transport, and has a separate folder.
class Victim {
 public:
  /// `lab`: as made by make_lab(). `max_descriptors`: that it may have open.
  Victim(const std::filesystem::path& folder, const std::filesystem::path& lab,
         unsigned long max_descriptors);

  /// `transport`: "tcp", "unix" or "tls".
  std::string address(const std::string& transport) const;
  client::ClientOptions options(const std::string& transport) const;
  const std::string& certificates() const { return certificates_; }
  std::filesystem::path store() const { return folder_ / "models.sqlite"; }
  std::filesystem::path audit() const { return folder_ / "audit.jsonl"; }
  const std::filesystem::path& folder() const { return folder_; }
  pid_t pid() const { return daemon_.pid(); }
  int stop() { return daemon_.stop(); }

 private:
  std::filesystem::path folder_;
  std::string certificates_;
  int tls_port_;
  DaemonProcess daemon_;
};

}  // namespace hapticd::bench
