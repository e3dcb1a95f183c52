#include "tests/measure/report/progress.h"

#include <unistd.h>

#include <iostream>

namespace hapticd::report {

namespace {
constexpr std::size_t kBarWidth = 30;
}

Progress::Progress(std::string what, std::size_t steps)
    : what_(std::move(what)), steps_(steps), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (terminal_ && done_ > 0) std::cerr << std::endl;
}

void Progress::step() {
  const std::lock_guard lock(mutex_);
  ++done_;
  draw();
}

void Progress::draw() {
  const std::size_t tenths = 10 * done_ / steps_;
  if (!terminal_ && tenths == reported_tenths_) return;
  reported_tenths_ = tenths;
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
  const double left_s = elapsed.count() * static_cast<double>(steps_ - done_) / static_cast<double>(done_);
  const std::size_t filled = kBarWidth * done_ / steps_;
  std::cerr << (terminal_ ? "\r" : "") << '[' << std::string(filled, '#')
            << std::string(kBarWidth - filled, '.') << "] " << done_ << " of " << steps_ << ", " << what_
            << ", " << static_cast<long>(left_s) << " s left   ";
  terminal_ ? std::cerr << std::flush : std::cerr << std::endl;
}

}  // namespace hapticd::report
