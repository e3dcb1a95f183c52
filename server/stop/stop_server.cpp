#include "server/stop/stop_server.h"

#include <pthread.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "proto/text/report_rate.h"
#include "server/process/ending_signals.h"
#include "server/stop/stop_listener.h"

namespace hapticd::server {

namespace {

constexpr int kMaxReportsPerS = 20;

}  // namespace

hal::Result<std::unique_ptr<StopServer>> StopServer::start(Parts parts) {
  std::unique_ptr<StopServer> server(new StopServer(std::move(parts)));
  Parts& own = server->parts_;
  if (!own.certificates.empty()) {
    auto opened = TlsServer::open(own.certificates, "");
    if (!opened) return opened.error();
    server->tls_ = std::move(*opened);
  }
  const sigset_t stopping = stopping_signals();
  server->signals_ = signalfd(-1, &stopping, SFD_CLOEXEC | SFD_NONBLOCK);
  server->arrived_ = eventfd(0, EFD_CLOEXEC);
  if (server->signals_ < 0 || server->arrived_ < 0) {
    return hal::Error{"stops cannot be waited for", "hapticd", std::strerror(errno), "",
                      "raise LimitNOFILE (ulimit -n)"};
  }
  server->local_ = std::make_unique<StopListener>(
      StopListener::Parts{own.sockets.plain, own.sockets.datagram, server->signals_, nullptr, own.rights,
                          own.stop, server->arrived_, "hapticd-stop"});
  if (server->tls_) {
    server->remote_ = std::make_unique<StopListener>(
        StopListener::Parts{own.sockets.tls, -1, -1, server->tls_.get(), own.rights, own.stop,
                            server->arrived_, "hapticd-tlsstop"});
  }
  server->reporting_ = std::thread([here = server.get()] { here->run_reports(); });
  return server;
}

StopServer::StopServer(Parts parts) : parts_(std::move(parts)) {}

StopServer::~StopServer() {
  is_serving_.store(false);
  if (reporting_.joinable()) {
    eventfd_write(arrived_, 1);
    reporting_.join();
  }
  local_.reset();
  remote_.reset();
  for (const int descriptor : {signals_, arrived_}) {
    if (descriptor >= 0) close(descriptor);
  }
}

void StopServer::run_reports() {
  pthread_setname_np(pthread_self(), "hapticd-stops");
  // Counted apart, so that those who are refused cannot hide who stopped.
  text::ReportRate granted(kMaxReportsPerS);
  text::ReportRate refused(kMaxReportsPerS);
  std::uint64_t lost = 0;
  while (is_serving_.load()) {
    eventfd_t unused = 0;
    eventfd_read(arrived_, &unused);
    for (StopListener* listener : {local_.get(), remote_.get()}) {
      if (listener == nullptr) continue;
      StopReport report;
      while (listener->pop_report(report)) {
        text::ReportRate& rate = report.was_refused ? refused : granted;
        const auto unreported = rate.take(std::chrono::steady_clock::now());
        if (unreported) parts_.report(report, *unreported + std::exchange(lost, 0));
      }
      lost += listener->take_lost();
    }
  }
}

}  // namespace hapticd::server
