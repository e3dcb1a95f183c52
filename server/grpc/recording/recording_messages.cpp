#include "server/grpc/recording/recording_messages.h"

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>

#include "server/grpc/messages/enums.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

v1::RecordingState state_of(RecordingState state) {
  switch (state) {
    case RecordingState::kRunning:
      return v1::RECORDING_STATE_RUNNING;
    case RecordingState::kFinished:
      return v1::RECORDING_STATE_FINISHED;
    case RecordingState::kRepaired:
      return v1::RECORDING_STATE_REPAIRED;
    case RecordingState::kUnfinished:
      return v1::RECORDING_STATE_UNFINISHED;
    case RecordingState::kForeign:
      return v1::RECORDING_STATE_FOREIGN;
  }
  return v1::RECORDING_STATE_UNSPECIFIED;
}

/// Adds a file after those that it imports.
void add_file(const google::protobuf::FileDescriptor& file, std::set<std::string>& there,
              google::protobuf::FileDescriptorSet& set) {
  if (!there.insert(file.name()).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) add_file(*file.dependency(i), there, set);
  file.CopyTo(set.add_file());
}

}  // namespace

void fill(const RecordingInfo& info, v1::RecordingKind kind, v1::RecordingFile& file) {
  file.set_id(repaired_utf8(info.id));
  file.set_kind(kind);
  file.set_state(state_of(info.state));
  file.set_name(repaired_utf8(info.name));
  file.set_note(repaired_utf8(info.note));
  file.set_by(repaired_utf8(info.by));
  file.set_started_unix_ns(info.started_unix_ns);
  file.set_duration_s(info.duration_s);
  file.set_rows(info.rows);
  file.set_lost_ticks(info.lost_ticks);
  file.set_bytes(info.bytes);
  file.set_end_reason(repaired_utf8(info.end_reason));
  file.set_cause_tick(info.cause_tick);
  file.set_cause_after_s(info.cause_after_s);
  file.set_cause(repaired_utf8(info.cause));
}

Outcome<std::uint32_t> channels_of(const v1::StartRecordingRequest& request) {
  std::uint32_t channels = 0;
  for (int i = 0; i < request.groups_size(); ++i) {
    const v1::FieldGroup group = request.groups(i);
    if (!v1::FieldGroup_IsValid(group) || group == v1::FIELD_GROUP_UNSPECIFIED) {
      return Refusal{RefusalKind::kInvalidArgument,
                     {"unknown field group", fmt::format("StartRecordingRequest.groups[{}]", i),
                      std::to_string(static_cast<int>(group)), "a FieldGroup of the contract",
                      "name groups that exist, or none to record all"}};
    }
    channels |= channel_of(group);
  }
  return channels;
}

std::string schema_of(const std::string& message) {
  const auto* found = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(message);
  if (found == nullptr) return {};
  google::protobuf::FileDescriptorSet set;
  std::set<std::string> there;
  add_file(*found->file(), there, set);
  return set.SerializeAsString();
}

}  // namespace hapticd::server
