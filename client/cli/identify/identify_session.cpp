#include "client/cli/identify/identify_session.h"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "client/cli/identify/identify_figure.h"
#include "client/cli/identify/identify_upload.h"
#include "client/cli/identify/identify_view.h"
#include "client/cli/plot/svg_file.h"
#include "client/cli/session/interrupt.h"
#include "client/cli/session/print.h"
#include "client/cli/text/message_json.h"
#include "client/cli/text/names.h"
#include "client/cli/text/progress_bar.h"
#include "client/cli/text/text_table.h"

namespace hapticd::cli {
namespace {

constexpr std::chrono::seconds kLinePeriod{1};
constexpr double kMegabyte = 1e6;

/// Exit code: a refusal counts for the whole session; an incomplete result has its own code.
ExitCode exit_code_of(const v1::IdentificationProgress& progress) {
  switch (progress.state()) {
    case v1::IDENTIFICATION_STATE_CONVERGED:
      return ExitCode::kOk;
    case v1::IDENTIFICATION_STATE_FAILED:
      return ExitCode::kRefused;
    default:
      return ExitCode::kNotConverged;
  }
}

std::string upload_line(const std::string& name, const UploadState& state, const Terminal& terminal) {
  constexpr int kBarColumns = 32;
  const std::string sent = fmt::format("{:.1f}", static_cast<double>(state.sent_bytes) / kMegabyte);
  const std::string rate = fmt::format("{:.1f} MB/s", state.mb_per_s());
  if (state.sent) return fmt::format("{}: {} MB sent, {}; the daemon reads them", name, sent, rate);
  if (!state.total_bytes) return fmt::format("{}: {} MB sent, {}", name, sent, rate);
  const double share = *state.total_bytes == 0
                           ? 0.0
                           : static_cast<double>(state.sent_bytes) / static_cast<double>(*state.total_bytes);
  return fmt::format("{}: {} {}  {} of {:.1f} MB, {}", name, progress_bar(share, kBarColumns, terminal),
                     percent_done(share), sent, static_cast<double>(*state.total_bytes) / kMegabyte, rate);
}

Json upload_event(const std::string& name, const UploadState& state) {
  Json event{{"name", name}, {"sent_bytes", state.sent_bytes}, {"mb_per_s", state.mb_per_s()}};
  if (state.total_bytes) event["total_bytes"] = *state.total_bytes;
  return {{"uploading", event}};
}

}  // namespace

IdentifySession::IdentifySession(Session& session, IdentifyOptions options)
    : session_(session),
      options_(std::move(options)),
      client_(session.connect()),
      live_(Terminal::detect().live && !session.json) {
  if (!options_.user_request) catch_interrupts();
}

UserRequest IdentifySession::user_request() const {
  if (options_.user_request) return options_.user_request();
  if (terminated()) return UserRequest::kLeave;
  return interrupted() ? UserRequest::kCancel : UserRequest::kGoOn;
}

void IdentifySession::say(const std::string& line) const {
  if (session_.json) return;
  print_line(line);
  std::fflush(stdout);
}

std::string IdentifySession::upload(const std::string& path, const v1::RecordingDescription& description) {
  const UploadOptions options{.timeout = std::chrono::milliseconds(std::llround(session_.timeout_s * 1000.0)),
                              .on_progress =
                                  [&](const UploadState& state) {
                                    if (session_.json && std::chrono::steady_clock::now() >= next_line_) {
                                      next_line_ = std::chrono::steady_clock::now() + kLinePeriod;
                                      print_json_line(upload_event(description.name(), state));
                                      std::fflush(stdout);
                                    }
                                    if (!live_ || !screen_.due()) return;
                                    const Terminal terminal = Terminal::detect();
                                    screen_.show({upload_line(description.name(), state, terminal)},
                                                 terminal);
                                  },
                              .interrupted = [this] { return user_request() != UserRequest::kGoOn; }};
  const v1::UploadRecordingResponse answer = upload_file(client_, path, description, options);
  if (live_) screen_.show({}, Terminal::detect());
  screen_.keep();
  if (session_.json) {
    print_json_line({{"upload", to_json(answer)}});
  } else {
    // Unknown if the columns were not understood; a remark says so.
    const std::string length =
        answer.duration_s() > 0.0 ? fmt::format(", {:.1f} s", answer.duration_s()) : std::string();
    say(fmt::format("{}: {} rows{}, is {}", description.name(), answer.rows(), length, answer.recording()));
    for (const auto& remark : answer.remarks()) say("  remark   " + remark);
  }
  return answer.recording();
}

void IdentifySession::start(v1::StartIdentificationRequest request, const std::string& recording_path,
                            const v1::RecordingDescription& description, const std::string& reference_path) {
  if (!reference_path.empty()) {
    v1::RecordingDescription of_reference = description;
    of_reference.set_name(recording_name(reference_path));
    request.mutable_inclusion()->set_reference_recording(upload(reference_path, of_reference));
  }
  if (!recording_path.empty()) request.set_recording(upload(recording_path, description));
  const std::string identification = client_.start_identification(request).identification();
  if (options_.detach) {
    if (session_.json) return print_json({{"identification", identification}});
    return say(
        fmt::format("{0} runs; look: hapticctl identify watch {0}; end it: hapticctl identify cancel {0}",
                    identification));
  }
  if (!live_) say(identification + " runs");
  if (follow(identification) == IdentifyEnd::kOver) return conclude(*last_);
  if (user_request() == UserRequest::kLeave) {
    return say(fmt::format("{0} goes on; look: hapticctl identify watch {0}", identification));
  }
  conclude(cancel_now(identification));
}

void IdentifySession::watch(const std::string& identification) {
  if (follow(identification) == IdentifyEnd::kOver) return conclude(*last_);
  const std::string name = last_ ? last_->identification() : identification;
  say(fmt::format("{0} goes on; end it: hapticctl identify cancel {0}", name));
}

void IdentifySession::cancel(const std::string& identification) {
  const v1::IdentificationProgress progress = client_.cancel_identification(identification);
  conclude(progress);
  // It is over as the user asked, with or without a result.
  session_.exit_code = ExitCode::kOk;
}

v1::IdentificationProgress IdentifySession::cancel_now(const std::string& identification) {
  if (live_) {
    show_frame("cancelling: what was gathered is kept (Ctrl-C again exits at once)");
  } else {
    say("cancelling: what was gathered is kept");
  }
  try {
    return client_.cancel_identification(identification);
  } catch (const client::Error& error) {
    if (error.kind() != client::ErrorKind::kUnreachable) throw;
  }
  // The connection may have been the lost one.
  client_ = session_.connect();
  return client_.cancel_identification(identification);
}

IdentifyEnd IdentifySession::follow(const std::string& identification) {
  IdentifyFollow follow;
  follow.connect = [this] { return session_.connect(); };
  follow.on_progress = [this](const v1::IdentificationProgress& progress) { show(progress); };
  follow.leave = [this] { return user_request() != UserRequest::kGoOn; };
  follow.timeout = options_.timeout;
  follow.on_idle = [this](const std::string& notice) {
    if (live_ && screen_.due()) show_frame(notice);
    if (!live_ && !notice.empty() && !notice_reported_) print_error_line("hapticctl: {}", notice);
    notice_reported_ = !notice.empty();
  };
  return follow_identification(client_, identification, follow);
}

void IdentifySession::show(const v1::IdentificationProgress& progress) {
  last_ = progress;
  if (session_.json) {
    print_json_line(to_json(progress));
    std::fflush(stdout);
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  // The report says how it ended.
  if (live_ || now < next_line_ || is_over(progress)) return;
  next_line_ = now + kLinePeriod;
  say(identify_line(progress, Terminal::detect()));
}

void IdentifySession::show_frame(const std::string& notice) {
  if (!last_) return;
  const Terminal terminal = Terminal::detect();
  screen_.show(identify_frame(*last_, notice, terminal), terminal);
}

void IdentifySession::conclude(const v1::IdentificationProgress& progress) {
  session_.exit_code = exit_code_of(progress);
  if (session_.json) {
    // One that was watched has been reported already.
    const bool reported = last_ && is_over(*last_);
    if (!reported) print_json_line(to_json(progress));
  } else {
    const Terminal terminal = Terminal::detect();
    // The last frame keeps the plots; the result is below.
    if (live_ && last_) screen_.show(identify_frame(progress, "", terminal), terminal);
    screen_.keep();
    if (live_) say("");
    for (const auto& line : identify_report(progress, options_.adopt, terminal)) say(line);
  }
  if (options_.svg.empty()) return;
  const Figure figure = identify_figure(progress);
  if (figure.panels.empty()) {
    throw LocalError("there is nothing to draw: no fit and no coverage", options_.svg);
  }
  write_svg(figure, options_.svg);
  say("  plot     " + options_.svg);
}

void IdentifySession::list() {
  const auto answer = client_.identifications();
  if (session_.json) return print_json(to_json(answer));
  using Align = TextTable::Align;
  TextTable table({"identification", "what", "state", "done", "s", "residual", "model"},
                  {Align::kLeft, Align::kLeft, Align::kLeft, Align::kRight, Align::kRight, Align::kRight});
  for (const auto& one : answer.identifications()) {
    table.add({one.identification(), identify_subject(one), word(one.state()),
               is_of_earlier_run(one) ? "-" : percent_done(one.completion()),
               is_of_earlier_run(one) ? "-" : fmt::format("{:.1f}", one.duration_s()),
               one.has_residual() ? fmt::format("{:.2g} %", 100.0 * one.residual()) : "-",
               one.model().empty() ? "-" : one.model().substr(0, 12)});
  }
  table.print(Terminal::detect());
}

}  // namespace hapticd::cli
