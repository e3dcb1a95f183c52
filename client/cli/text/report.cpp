#include "client/cli/text/report.h"

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "client/cli/session/print.h"
#include "client/cli/text/command_words.h"

namespace hapticd::cli {
namespace {

/// "no_scene" for ERROR_REASON_NO_SCENE; empty if the error has no reason.
std::string reason_word(const v1::ErrorDetail& detail) {
  constexpr std::string_view kPrefix = "ERROR_REASON_";
  if (detail.reason() == v1::ERROR_REASON_UNSPECIFIED) return {};
  std::string name = v1::ErrorReason_Name(detail.reason());
  if (!name.starts_with(kPrefix)) return "unknown_" + std::to_string(static_cast<int>(detail.reason()));
  name.erase(0, kPrefix.size());
  for (char& c : name) c = static_cast<char>(c == '_' ? c : c - 'A' + 'a');
  return name;
}

constexpr const char* kLocal = "error";

Json error_json(const char* kind, const std::string& code, const v1::ErrorDetail& detail) {
  return {{"error",
           {{"kind", kind},
            {"code", code},
            {"reason", reason_word(detail)},
            {"what", detail.what()},
            {"where", detail.where()},
            {"value", detail.value()},
            {"limit", detail.limit()},
            {"remedy", detail.remedy()}}}};
}

void print_error(const char* kind, const std::string& code, const v1::ErrorDetail& contract_detail,
                 bool json) {
  const v1::ErrorDetail detail = in_command_words(contract_detail);
  if (json) return print_json(error_json(kind, code, detail));
  print_error_line("hapticctl: {}: {}", kind, detail.what());
  const auto line = [](const char* label, const std::string& text) {
    if (!text.empty()) print_error_line("  {:<9} {}", label, text);
  };
  line("where", detail.where());
  line("given", detail.value());
  line("accepted", detail.limit());
  line("remedy", detail.remedy());
  line("status", code);
}

}  // namespace

ExitCode report(const client::Error& error, const Session& session) {
  switch (error.kind()) {
    case client::ErrorKind::kRefused:
      print_error("refused", error.code(), error.detail(), session.json);
      return ExitCode::kRefused;
    case client::ErrorKind::kBadAddress:
      print_error("usage", error.code(), error.detail(), session.json);
      return ExitCode::kUsage;
    case client::ErrorKind::kUnreachable:
      print_error("unreachable", error.code(), error.detail(), session.json);
      return ExitCode::kUnreachable;
    case client::ErrorKind::kTimedOut:
      print_error("no answer", error.code(), error.detail(), session.json);
      return ExitCode::kUnreachable;
    case client::ErrorKind::kUnreadable:
      print_error("unreadable", error.code(), error.detail(), session.json);
      return ExitCode::kUnreachable;
    case client::ErrorKind::kBadClock:
      print_error("clock", error.code(), error.detail(), session.json);
      return ExitCode::kUsage;
  }
  return ExitCode::kUsage;
}

ExitCode report(const LocalError& error, const Session& session) {
  print_error(kLocal, "", error.detail(), session.json);
  return ExitCode::kUsage;
}

Json to_json(const LocalError& error) {
  return error_json(kLocal, "", in_command_words(error.detail()));
}

ExitCode report_usage(const LocalError& error, const Session& session) {
  print_error("usage", "", error.detail(), session.json);
  return ExitCode::kUsage;
}

}  // namespace hapticd::cli
