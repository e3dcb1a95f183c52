#include "server/grpc/calls/standing_poller.h"

#include <pthread.h>

namespace hapticd::server {

StandingPoller::~StandingPoller() {
  queue_->Shutdown();
  if (thread_.joinable()) {
    thread_.join();
  } else {
    drain();
  }
}

void StandingPoller::start() {
  thread_ = std::thread([this] {
    pthread_setname_np(pthread_self(), "hapticd-poller");
    drain();
  });
}

void StandingPoller::drain() {
  void* tag = nullptr;
  bool ok = false;
  while (queue_->Next(&tag, &ok)) {
  }
}

}  // namespace hapticd::server
