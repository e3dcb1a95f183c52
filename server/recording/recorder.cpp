#include "server/recording/recorder.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <utility>

#include "proto/text/utc_text.h"
#include "server/process/log.h"
#include "server/text/suggestion.h"
#include "server/text/utf8_text.h"

namespace hapticd::server {

namespace {

constexpr std::uint32_t kMaxDecimation = 10'000;

/// Refusals name some of them only: there may be thousands.
constexpr std::size_t kNamedIds = 10;

/// Length of a recording for which there must be room when it starts.
constexpr double kFirstS = 3.0;

/// Size of a file of so long, not compressed, in 10⁶ bytes: its rows, and what is written before and behind
/// them.
double first_mb(const RecordingSources& sources, const RunOptions& options) {
  constexpr double kTextsBytes = 4096.0;  // short ones: names, times, the description of columns
  const double rows = 1.0 + kFirstS * sources.rate_hz / options.decimation;
  const auto row_bytes = static_cast<double>(ColumnTable(sources.columns, options.channels).row_bytes());
  std::size_t texts = sources.configuration.size();
  for (const auto& [key, text] : sources.scene()) texts += key.size() + text.size();
  const std::size_t schemas = sources.block_schema.size() + sources.event_schema.size();
  texts += 2 * schemas;  // at the beginning, and in the summary
  return 1e-6 * (rows * row_bytes + static_cast<double>(texts) + kTextsBytes);
}

Refusal not_recording() {
  return {RefusalKind::kFailedPrecondition,
          {"no recording is running", "recording", "", "", "start one: hapticctl record start"}};
}

}  // namespace

Refusal no_such_recording(const std::string& id, const std::vector<std::string>& ids) {
  std::vector<std::string> some = ids;
  if (some.size() > kNamedIds) some.erase(some.begin(), some.end() - kNamedIds);
  return {RefusalKind::kNotFound,
          {"there is no such recording", "id", shortened(repaired_utf8(id), 200), comma_separated(some),
           did_you_mean(id, ids, "see hapticctl record list, or hapticctl incident list")}};
}

Recorder::Recorder(TelemetryHub& hub, EventLog& event_log, const RecordingSources& sources,
                   const RecordingConfig& config)
    : hub_(hub),
      event_log_(event_log),
      sources_(sources),
      folder_(config.folder + "/recordings",
              {config.quota_mb, config.when_full, config.keep_free_mb, "[recording] quota_mb"}),
      has_folder_(!config.folder.empty()) {}

std::optional<hal::Error> Recorder::open() {
  if (!has_folder_) return std::nullopt;
  problem_ = folder_.open();
  if (problem_) return problem_;
  for (const std::string& line : folder_.repair_all()) log_warning(line);
  return std::nullopt;
}

std::optional<Refusal> Recorder::unavailable() const {
  if (!has_folder_) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   hal::Error::of(hal::ErrorCode::kSwitchedOff, "this daemon has no folder for recordings",
                                  "[recording] folder", "", "",
                                  "name one, or start hapticd with a --model-store that is not in memory")};
  }
  if (problem_) return Refusal{RefusalKind::kFailedPrecondition, *problem_};
  return std::nullopt;
}

RecordingInfo Recorder::info_of(const RecordingRun& run) const {
  const RunReport report = run.report();
  RecordingInfo info;
  const recording::Texts& start = run.start_texts();
  info.id = run.id();
  info.name = start.at("name");
  info.note = start.at("note");
  info.by = start.at("by");
  info.started_unix_ns = std::stoll(start.at("started_unix_ns"));
  info.start = start;
  info.state = report.is_running ? RecordingState::kRunning : RecordingState::kFinished;
  info.rows = report.rows;
  info.lost_ticks = report.lost_ticks;
  info.bytes = report.bytes;
  info.duration_s = report.duration_s;
  info.end_reason = report.end_reason;
  return info;
}

std::shared_ptr<RecordingRun> Recorder::current() const {
  const MutexLock lock(current_mutex_);
  return run_;
}

void Recorder::replace_current(std::shared_ptr<RecordingRun> run) {
  std::shared_ptr<RecordingRun> before;  // ends, if it does, without the lock
  const MutexLock lock(current_mutex_);
  before = std::exchange(run_, std::move(run));
}

Outcome<RecordingInfo> Recorder::start(const RecordingRequest& request) {
  if (auto refusal = unavailable()) return *refusal;
  if (request.decimation < 1 || request.decimation > kMaxDecimation) {
    return Refusal{RefusalKind::kOutOfRange,
                   {"the decimation is out of range", "StartRecordingRequest.decimation",
                    std::to_string(request.decimation), fmt::format("1 … {}", kMaxDecimation), ""}};
  }
  if (request.channels != 0 && (request.channels & sources_.channels) == 0) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"this rig has none of these groups", "StartRecordingRequest.groups", "", "",
                    "truth is known on a simulated rig only; name no group to record all"}};
  }
  if (request.note.size() > kMaxText || request.name.size() > kMaxText) {
    return Refusal{
        RefusalKind::kInvalidArgument,
        {"the text is too long", "StartRecordingRequest", "", fmt::format("{} bytes", kMaxText), ""}};
  }
  const MutexLock lock(changes_);
  if (ending_) return Refusal{RefusalKind::kUnavailable, {"the daemon is shutting down", "", "", "", ""}};
  if (const auto before = current(); before && before->report().is_running) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"a recording is running already", "recording", before->id(), "one at a time",
                    "stop it first: hapticctl record stop"},
                   Reason::kBusy};
  }
  RunOptions options;
  const std::uint32_t asked = request.channels == 0 ? sources_.channels : request.channels;
  options.channels = asked & sources_.channels;
  options.decimation = request.decimation;
  if (auto error = folder_.make_room("", first_mb(sources_, options))) return cannot_record(*error);
  const std::int64_t now_ns = sources_.clocks().utc_ns;
  const std::filesystem::path path = folder_.new_path(now_ns, request.name);
  options.path = path.string();
  options.id = path.stem().string();
  options.start = sources_.rig;
  options.start["name"] = request.name.empty() ? options.id : request.name;
  options.start["note"] = request.note;
  options.start["by"] = request.by;
  options.start["started_unix_ns"] = std::to_string(now_ns);
  options.start["started"] = text::utc_text(now_ns, 3);
  options.start["rate_hz"] = fmt::format("{:g}", sources_.rate_hz);
  options.start["decimation"] = std::to_string(request.decimation);
  options.must_end = [this, id = options.id, is_over = request.is_over]() -> std::optional<hal::Error> {
    if (auto why = is_over()) return why;
    return folder_.make_room(id);
  };
  auto run = RecordingRun::start(hub_, event_log_, sources_, std::move(options));
  if (!run) return run.refusal();
  const std::shared_ptr<RecordingRun> started = std::move(*run);
  replace_current(started);
  return info_of(*started);
}

Outcome<RecordingInfo> Recorder::stop(const std::string& by) {
  const MutexLock lock(changes_);
  const auto run = current();
  if (!run) return not_recording();
  // One that has ended by itself says why.
  run->end("stopped by " + (by.empty() ? std::string("a client") : by));
  replace_current(nullptr);
  return info_of(*run);
}

std::optional<Refusal> Recorder::annotate(const std::string& text, const std::string& by) {
  if (text.empty() || text.size() > kMaxText) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"the note has a wrong length", "AnnotateRequest.text",
                    fmt::format("{} bytes", text.size()), fmt::format("1 … {} bytes", kMaxText), ""}};
  }
  if (!running()) return not_recording();
  const ClockAnchor now = anchor_of(sources_);
  recording::Event event;
  event.time_ns = now.time_ns;
  event.unix_ns = now.unix_ns;
  event.tick = hub_.latest().tick;
  event.kind = recording::EventKind::kAnnotation;
  event.text = text;
  event.by = by;
  event_log_.add(std::move(event));
  return std::nullopt;
}

Outcome<std::vector<RecordingInfo>> Recorder::list() const {
  if (auto refusal = unavailable()) return *refusal;
  const auto now = running();
  std::vector<RecordingInfo> all = folder_.list();
  if (now) {
    std::erase_if(all, [&](const RecordingInfo& info) { return info.id == now->id; });
    all.push_back(*now);
  }
  return all;
}

Outcome<std::string> Recorder::path_of(const std::string& id) const {
  if (auto refusal = unavailable()) return *refusal;
  const auto path = folder_.find(id);
  if (!path) return no_such_recording(id, folder_.ids());
  const auto now = running();
  if (now && now->id == id) {
    return Refusal{RefusalKind::kFailedPrecondition,
                   {"the recording is still running", "id", id, "", "stop it first: hapticctl record stop"},
                   Reason::kBusy};
  }
  return *path;
}

Outcome<RecordingInfo> Recorder::remove(const std::string& id) {
  const auto path = path_of(id);
  if (!path) return path.refusal();
  RecordingInfo info = read_info(*path);
  if (auto error = folder_.remove(id)) return Refusal{RefusalKind::kFailedPrecondition, *error};
  return info;
}

std::optional<RecordingInfo> Recorder::running() const {
  const auto run = current();
  return run && run->report().is_running ? std::optional(info_of(*run)) : std::nullopt;
}

void Recorder::shutdown() {
  const MutexLock lock(changes_);
  ending_ = true;
  if (const auto run = current()) run->end("the daemon ended");
  replace_current(nullptr);
}

}  // namespace hapticd::server
