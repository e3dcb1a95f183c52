#include "tests/integration/command_record.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

namespace hapticd::test {

CommandRecord::CommandRecord(const std::shared_ptr<grpc::Channel>& channel)
    : stub_(v1::TelemetryService::NewStub(channel)) {
  v1::SubscribeRequest request;
  for (const v1::FieldGroup group :
       {v1::FIELD_GROUP_GUARD, v1::FIELD_GROUP_TARGET, v1::FIELD_GROUP_DEFORMATION}) {
    request.add_groups(group);
  }
  request.set_queue_samples(60000);
  reader_ = stub_->Subscribe(&context_, request);
  v1::TelemetryBatch first;
  EXPECT_TRUE(reader_->Read(&first)) << "no telemetry";
  thread_ = std::thread([this, batch = std::move(first)]() mutable {
    do {
      const std::lock_guard lock(mutex_);
      for (const v1::TelemetrySample& sample : batch.samples()) {
        const v1::Vector3& force = sample.guard().device_command_n();
        ticks_[sample.tick()] = {sample.time_ns(),
                                 {force.x(), force.y(), force.z()},
                                 sample.guard().state(),
                                 sample.target().target_stiffness_n_per_mm(),
                                 sample.deformation().displacement_mm()};
      }
    } while (reader_->Read(&batch));
  });
}

CommandRecord::~CommandRecord() {
  if (thread_.joinable()) stop();
}

template <class Found>
std::uint64_t CommandRecord::await(std::uint64_t from, Found found) {
  const auto until = std::chrono::steady_clock::now() + kTimeout;
  while (std::chrono::steady_clock::now() < until) {
    {
      const std::lock_guard lock(mutex_);
      for (auto tick = ticks_.lower_bound(from); tick != ticks_.end(); ++tick) {
        if (found(tick->second)) return tick->first;
      }
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  ADD_FAILURE() << "waited in vain";
  return 0;
}

std::uint64_t CommandRecord::await_latched(std::uint64_t from) {
  return await(from, [](const Tick& tick) { return tick.state == v1::GUARD_STATE_LATCHED; });
}

void CommandRecord::await_tick(std::uint64_t tick) {
  await(tick, [](const Tick&) { return true; });
}

std::uint64_t CommandRecord::last_tick() {
  const std::lock_guard lock(mutex_);
  return ticks_.empty() ? 0 : ticks_.rbegin()->first;
}

std::map<std::uint64_t, CommandRecord::Tick> CommandRecord::stop() {
  context_.TryCancel();
  return read_to_the_end();
}

std::map<std::uint64_t, CommandRecord::Tick> CommandRecord::read_to_the_end() {
  thread_.join();
  reader_->Finish();
  return std::move(ticks_);
}

LargestStep largest_step(const std::map<std::uint64_t, CommandRecord::Tick>& ticks) {
  LargestStep largest;
  std::uint64_t at = 0;
  for (auto later = ticks.begin(); later != ticks.end(); ++later) {
    if (later == ticks.begin()) continue;
    const auto earlier = std::prev(later);
    const bool renders = earlier->second.state == v1::GUARD_STATE_RENDERING &&
                         later->second.state == v1::GUARD_STATE_RENDERING;
    if (!renders || later->first != earlier->first + 1) continue;
    const hal::Vector3 step = later->second.force_n - earlier->second.force_n;
    const double step_n = std::sqrt(dot(step, step));
    if (step_n <= largest.step_n) continue;
    largest.step_n = step_n;
    at = later->first;
  }
  std::ostringstream around;
  for (auto tick = ticks.lower_bound(at < 6 ? 0 : at - 6); tick != ticks.end() && tick->first <= at + 6;
       ++tick) {
    const CommandRecord::Tick& t = tick->second;
    around << "tick " << tick->first << ": " << t.force_n.x << " " << t.force_n.y << " " << t.force_n.z
           << " N, target " << t.target_n_per_mm << " N/mm, " << t.displacement_mm << " mm\n";
  }
  largest.around = around.str();
  return largest;
}

}  // namespace hapticd::test
