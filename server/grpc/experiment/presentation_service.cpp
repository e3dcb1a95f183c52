#include "server/grpc/experiment/presentation_service.h"

#include <bit>

#include "server/grpc/calls/call.h"
#include "server/grpc/messages/status.h"
#include "server/session/session.h"

namespace hapticd::server {

namespace {

// Bit n is the flaw of number n + 1.
static_assert(rt::watch_bit::kPressSpeed == 1U << (v1::PRESENTATION_FLAW_PRESS_SPEED - 1));
static_assert(rt::watch_bit::kLateralPath == 1U << (v1::PRESENTATION_FLAW_LATERAL_PATH - 1));
static_assert(rt::watch_bit::kTicksLost == 1U << (v1::PRESENTATION_FLAW_TICKS_LOST - 1));
static_assert(rt::watch_bit::kContactTime == 1U << (v1::PRESENTATION_FLAW_CONTACT_TIME - 1));

Outcome<rt::EngineOutcome> execute(Session& session, rt::EngineCommand::Kind kind,
                                   const grpc::ServerContext& context) {
  rt::EngineCommand command;
  command.kind = kind;
  return session.execute(command, caller_of(context), kDefaultTimeout);
}

}  // namespace

grpc::Status PresentationService::BeginPresentation(grpc::ServerContext* context,
                                                    const v1::BeginPresentationRequest*,
                                                    v1::BeginPresentationResponse* response) {
  const auto begun = execute(session_, rt::EngineCommand::Kind::kBeginPresentation, *context);
  if (!begun) return to_status(begun.refusal());
  response->set_number(begun->presentation.number);
  response->set_begin_tick(begun->tick);
  return grpc::Status::OK;
}

grpc::Status PresentationService::EndPresentation(grpc::ServerContext* context,
                                                  const v1::EndPresentationRequest*,
                                                  v1::PresentationSummary* response) {
  const auto ended = execute(session_, rt::EngineCommand::Kind::kEndPresentation, *context);
  if (!ended) return to_status(ended.refusal());
  const rt::PresentationSummary& summary = ended->presentation;
  response->set_number(summary.number);
  response->set_begin_tick(summary.begin_tick);
  response->set_end_tick(summary.end_tick);
  for (std::uint32_t flaws = summary.broken; flaws != 0; flaws &= flaws - 1)
    response->add_flaws(static_cast<v1::PresentationFlaw>(std::countr_zero(flaws) + 1));
  response->set_peak_press_speed_mm_per_s(summary.peak_press_speed_mm_per_s);
  response->set_peak_contact_speed_mm_per_s(summary.peak_contact_speed_mm_per_s);
  response->set_peak_lateral_mm(summary.peak_lateral_mm);
  response->set_lateral_path_mm(summary.lateral_path_mm);
  response->set_peak_force_n(summary.peak_force_n);
  response->set_peak_displacement_mm(summary.peak_displacement_mm);
  response->set_time_in_contact_s(summary.contact_s);
  response->set_contacts(summary.contacts);
  response->set_guard_limited_ticks(summary.guard_limited_ticks);
  response->set_late_ticks(summary.late_ticks);
  return grpc::Status::OK;
}

}  // namespace hapticd::server
