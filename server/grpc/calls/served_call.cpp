#include "server/grpc/calls/served_call.h"

#include <array>
#include <utility>

#include "server/access/audit_log.h"
#include "server/access/role_policy.h"
#include "server/session/session.h"

namespace hapticd::server {

namespace {

thread_local ServedCall* this_threads_call = nullptr;

std::string_view name_of(grpc::StatusCode code) {
  static constexpr std::array<std::string_view, 17> kNames{
      "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
      "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
      "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
      "DATA_LOSS", "UNAUTHENTICATED"};
  const auto index = static_cast<std::size_t>(code);
  return index < kNames.size() ? kNames[index] : "UNKNOWN";
}

}  // namespace

void ServedCall::note_end() const {
  if (audit == nullptr || row == nullptr || (status.ok() && !row->is_audited)) return;
  // A client that ends its stream was not refused.
  if (!row->is_audited && status.error_code() == grpc::StatusCode::CANCELLED) return;
  AuditLine line;
  line.tick = session->last_tick();
  line.identity = who.name;
  line.role = to_text(who.role);
  line.peer = who.peer;
  line.lease = lease;
  line.method = row->method;
  line.arguments = arguments;
  line.outcome = name_of(status.error_code());
  line.problem = status.error_message();
  if (status.ok()) line.effective_tick = effective_tick;
  audit->write(std::move(line));
}

void ServedCall::note_end(const grpc::Status& end, std::optional<std::uint64_t> tick) {
  status = end;
  effective_tick = tick;
  note_end();
}

ServedCall* served_call() {
  return this_threads_call;
}

grpc::ServerUnaryReactor* finish(grpc::CallbackServerContext& context, const grpc::Status& status) {
  if (ServedCall* call = served_call()) call->note_end(status, std::nullopt);
  grpc::ServerUnaryReactor* reactor = context.DefaultReactor();
  reactor->Finish(status);
  return reactor;
}

ServedCallScope::ServedCallScope(ServedCall& call) : before_(std::exchange(this_threads_call, &call)) {}

ServedCallScope::~ServedCallScope() {
  this_threads_call = before_;
}

}  // namespace hapticd::server
