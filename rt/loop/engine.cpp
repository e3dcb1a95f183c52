#include "rt/loop/engine.h"

#include <algorithm>
#include <bit>
#include <thread>

#include "rt/loop/flush_denormals.h"

namespace hapticd::rt {

namespace {
GuardLimits idle_limits(const hal::RigInfo& rig) {
  GuardLimits limits;
  limits.max_force_n = rig.device.max_force_n;
  limits.max_force_rate_n_per_s = rig.device.max_force_n / 0.005;
  limits.sensor_stale_after_ms = 0.0;  // without a scene the sensor is not needed
  return limits;
}
}  // namespace

Engine::Engine(const hal::Rig& rig, std::size_t record_capacity)
    : rig_(rig),
      renderer_(idle_limits(rig.info()), rig.info().rate_hz),
      mailbox_(kCommandSlots),
      records_(record_capacity),
      observations_(rig.owns_clock() ? std::min(record_capacity, kMaxObserverLead) : record_capacity) {}

Engine::~Engine() = default;

hal::DeviceCommand Engine::on_tick(const hal::RigSample& sample) noexcept {
  const FlushDenormals flush;  // whatever thread calls: a vendor's scheduler, a rig that owns its clock
  const bool observed = is_observed();
  take_commands(sample);
  if (raised_.load(std::memory_order_relaxed) != 0) {
    FaultSet raised = raised_.exchange(0, std::memory_order_acq_rel);
    for (; raised != 0; raised &= raised - 1)
      renderer_.raise(static_cast<GuardFault>(std::countr_zero(raised)));
  }

  FaultSet standing = standing_.load(std::memory_order_acquire);
  if (sample.time_ns > permit_until_ns_.load(std::memory_order_acquire)) [[unlikely]] {
    standing |= set_of(GuardFault::kEndpointMissing);
  }
  renderer_.set_standing(standing);

  TickRecord* const place = records_.claim();  // made where it is read: a record is some 1000 bytes
  TickRecord& record = place != nullptr ? *place : unsent_;
  const bool had_truth = (record.channels & channel::kTruth) != 0;
  const hal::DeviceCommand command = renderer_.tick(sample, record);
  record.channels |= channel::kTiming;
  record.timing = timing_;
  if (rig_.truth(record.truth)) {
    record.channels |= channel::kTruth;
  } else if (had_truth) {
    record.truth = {};
  }
  latest_.publish(record);
  if (place != nullptr) {
    records_.publish();
  } else {
    records_dropped_.store(records_dropped_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  if (observed) hand_on(sample, command);
  can_exchange_.store(renderer_.can_exchange_scene(), std::memory_order_release);
  last_time_ns_.store(sample.time_ns, std::memory_order_release);
  last_tick_.store(sample.tick, std::memory_order_release);
  return command;
}

// An observation that finds no room is lost; the gap in its ticks shows.
void Engine::hand_on(const hal::RigSample& sample, const hal::DeviceCommand& command) noexcept {
  Observation observation;
  observation.sample = sample;
  observation.device_command_n = command.force_n;
  observation.has_external_position = rig_.external_position(observation.external_position_mm);
  observations_.push(observation);
}

void Engine::observe(bool on) noexcept {
  if (on) {
    while (observations_.front() != nullptr) observations_.discard();
  }
  observed_.store(on, std::memory_order_release);
}

// At most kCommandSlots commands exist at all, so both loops are bounded.
void Engine::take_commands(const hal::RigSample& sample) noexcept {
  std::uint32_t number = 0;
  while (pending_count_ < kCommandSlots && mailbox_.pop(number)) pending_[pending_count_++] = number;

  std::size_t kept = 0;
  for (std::size_t i = 0; i < pending_count_; ++i) {
    Slot& slot = slots_[pending_[i]];
    if (slot.state.load(std::memory_order_acquire) == Slot::kWithdrawn) {
      slot.state.store(Slot::kFree, std::memory_order_release);
    } else if (!is_stale(slot.command) &&
               (slot.command.at_tick > sample.tick || slot.command.at_time_ns > sample.time_ns ||
                (slot.command.when_exchangeable && !renderer_.can_exchange_scene()))) {
      pending_[kept++] = pending_[i];
    } else {
      std::uint32_t expected = Slot::kWaiting;
      if (slot.state.compare_exchange_strong(expected, Slot::kPerforming, std::memory_order_acq_rel)) {
        perform(slot, sample);
        slot.state.store(Slot::kDone, std::memory_order_release);
      } else {  // withdrawn this very moment
        slot.state.store(Slot::kFree, std::memory_order_release);
      }
    }
  }
  pending_count_ = kept;
}

bool Engine::is_stale(const EngineCommand& command) const noexcept {
  return command.lease != 0 && command.lease < lease_.load(std::memory_order_seq_cst);
}

void Engine::perform(Slot& slot, const hal::RigSample& sample) noexcept {
  EngineOutcome& outcome = slot.outcome;
  outcome = EngineOutcome{};
  outcome.status = EngineOutcome::Status::kApplied;
  outcome.tick = sample.tick;
  outcome.time_ns = sample.time_ns;
  // Asked here and nowhere later: between this line and the command's effect nothing else runs.
  if (is_stale(slot.command)) {
    outcome.status = EngineOutcome::Status::kLeaseLost;
    return;
  }
  switch (slot.command.kind) {
    case EngineCommand::Kind::kSetTarget:
      if (!renderer_.has_scene()) outcome.status = EngineOutcome::Status::kNoScene;
      renderer_.set_target(slot.command.target, slot.command.ramp_s);
      break;
    case EngineCommand::Kind::kExchangeScene:
      outcome.retired =
          renderer_.exchange(slot.command.pipeline, slot.command.guard, slot.command.assistance);
      break;
    case EngineCommand::Kind::kClear:
      // One that was raised and is taken up in this tick only: the clear is older, or does not know of it.
      if (raised_.load(std::memory_order_acquire) != 0 || !renderer_.clear())
        outcome.status = EngineOutcome::Status::kFaultPersists;
      break;
    case EngineCommand::Kind::kBeginGuide:
      outcome.guide = renderer_.assistance().begin_guide(slot.command.guide);
      break;
    case EngineCommand::Kind::kCancelGuide:
      renderer_.assistance().cancel_guide();
      break;
    case EngineCommand::Kind::kBeginPresentation:
      outcome.presentation.number = renderer_.assistance().begin_presentation();
      if (outcome.presentation.number == 0) outcome.status = EngineOutcome::Status::kNoWatch;
      break;
    case EngineCommand::Kind::kEndPresentation:
      outcome.presentation = renderer_.assistance().end_presentation();
      if (outcome.presentation.number == 0) outcome.status = EngineOutcome::Status::kNoWatch;
      break;
  }
}

Engine::Slot* Engine::acquire_slot() {
  for (Slot& slot : slots_) {
    std::uint32_t expected = Slot::kFree;
    if (slot.state.compare_exchange_strong(expected, Slot::kReserved, std::memory_order_acq_rel))
      return &slot;
  }
  return nullptr;
}

EngineOutcome Engine::execute(const EngineCommand& command, std::chrono::nanoseconds timeout) {
  using Clock = std::chrono::steady_clock;
  Slot* slot = acquire_slot();
  if (slot == nullptr) {
    EngineOutcome refused;
    refused.status = EngineOutcome::Status::kQueueFull;
    return refused;
  }
  slot->command = command;
  slot->state.store(Slot::kWaiting, std::memory_order_release);
  {
    const MutexLock lock(producers_);
    mailbox_.push(
        static_cast<std::uint32_t>(slot - slots_.data()));  // as large as there are slots: never full
  }
  // The loop may not wake us (that is a system call), so we look. The poll interval is short: the answer is a
  // tick away.
  const Clock::time_point deadline = Clock::now() + timeout;
  while (slot->state.load(std::memory_order_acquire) != Slot::kDone) {
    if (Clock::now() >= deadline) {
      std::uint32_t expected = Slot::kWaiting;
      if (slot->state.compare_exchange_strong(expected, Slot::kWithdrawn, std::memory_order_acq_rel)) {
        return {};  // timed out; the loop frees the slot when it meets it
      }
      // being performed right now: done in a moment
    }
    std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  const EngineOutcome outcome = slot->outcome;
  slot->state.store(Slot::kFree, std::memory_order_release);
  return outcome;
}

}  // namespace hapticd::rt
