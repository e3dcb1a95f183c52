#include "tests/measure/bench/attack/victim.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

#include "tests/measure/report/child_process.h"

namespace hapticd::bench {
namespace {

constexpr std::chrono::seconds kTimeout{10};

/// One whose next port is free as well: that is the stop port.
int free_port_pair() {
  for (;;) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    const int first = socket(AF_INET, SOCK_STREAM, 0);
    bind(first, reinterpret_cast<const sockaddr*>(&address), length);
    getsockname(first, reinterpret_cast<sockaddr*>(&address), &length);
    const int port = ntohs(address.sin_port);
    address.sin_port = htons(static_cast<std::uint16_t>(port + 1));
    const int second = socket(AF_INET, SOCK_STREAM, 0);
    const bool is_free = bind(second, reinterpret_cast<const sockaddr*>(&address), length) == 0;
    close(first);
    close(second);
    if (is_free) return port;
  }
}

DaemonSetup setup_of(const std::filesystem::path& folder, const std::filesystem::path& lab, int tls_port,
                     unsigned long max_descriptors) {
  DaemonSetup setup;
  setup.max_descriptors = max_descriptors;
  setup.model_store = (folder / "models.sqlite").string();
  setup.more_configuration = "[access]\naudit_file_mb = 1000\naudit_file = \"" +
                             (folder / "audit.jsonl").string() + "\"\n[network]\nunix_socket = \"" +
                             (folder / "sock").string() +
                             "\"\nlisten_tls = \"127.0.0.1:" + std::to_string(tls_port) +
                             "\"\ncertificates = \"" + (lab / "servers/localhost").string() + "\"\n";
  return setup;
}

}  // namespace

void make_lab(const std::filesystem::path& folder) {
  const report::ProgramRun made = report::run_program(
      {.command = {"bash", SOURCE_FOLDER "/deploy/make_certificates.sh", "--lab", "bench", "--out",
                   folder.string(), "--server", "localhost,127.0.0.1", "--client", "operator/bench"}},
      std::chrono::seconds(60));
  if (made.status != 0) throw std::runtime_error("no certificates: " + made.output);
}

Victim::Victim(const std::filesystem::path& folder, const std::filesystem::path& lab,
               unsigned long max_descriptors)
    : folder_(folder),
      certificates_((lab / "clients/bench").string()),
      tls_port_(free_port_pair()),
      daemon_(folder / "hapticd.log", setup_of(folder, lab, tls_port_, max_descriptors)) {}

std::string Victim::address(const std::string& transport) const {
  if (transport == "unix") return "unix:" + (folder_ / "sock").string();
  return transport == "tls" ? "tls:127.0.0.1:" + std::to_string(tls_port_) : daemon_.address();
}

client::ClientOptions Victim::options(const std::string& transport) const {
  return {.address = address(transport),
          .timeout = kTimeout,
          .certificates = certificates_,
          .acquires_lease = true};
}

}  // namespace hapticd::bench
