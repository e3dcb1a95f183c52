#include "client/cli/session/session.h"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

namespace hapticd::cli {
namespace {

v1::ErrorDetail make_detail(const std::string& what, const std::string& where, const std::string& value,
                            const std::string& limit, const std::string& remedy) {
  v1::ErrorDetail detail;
  detail.set_what(what);
  detail.set_where(where);
  detail.set_value(value);
  detail.set_limit(limit);
  detail.set_remedy(remedy);
  return detail;
}

/// "no_scene" for ERROR_REASON_NO_SCENE; empty where the error has no reason.
std::string reason_word(const v1::ErrorDetail& detail) {
  constexpr std::string_view kPrefix = "ERROR_REASON_";
  if (detail.reason() == v1::ERROR_REASON_UNSPECIFIED) return {};
  std::string name = v1::ErrorReason_Name(detail.reason());
  if (!name.starts_with(kPrefix)) return "unknown_" + std::to_string(static_cast<int>(detail.reason()));
  name.erase(0, kPrefix.size());
  for (char& c : name) c = static_cast<char>(c == '_' ? c : c - 'A' + 'a');
  return name;
}

void print_error(const char* kind, const std::string& code, const v1::ErrorDetail& detail, bool json) {
  if (json) {
    print_json({{"error",
                 {{"kind", kind},
                  {"code", code},
                  {"reason", reason_word(detail)},
                  {"what", detail.what()},
                  {"where", detail.where()},
                  {"value", detail.value()},
                  {"limit", detail.limit()},
                  {"remedy", detail.remedy()}}}});
    return;
  }
  std::fflush(stdout);
  fmt::print(stderr, "hapticctl: {}: {}\n", kind, detail.what());
  const auto line = [](const char* label, const std::string& text) {
    if (!text.empty()) fmt::print(stderr, "  {:<9} {}\n", label, text);
  };
  line("where", detail.where());
  line("given", detail.value());
  line("accepted", detail.limit());
  line("remedy", detail.remedy());
  line("status", code);
}

}  // namespace

LocalError no_command_for_rigs() {
  return {"this command works on one rig", "--rigs", "", "status, doctor, stop",
          "name one rig with --server"};
}

client::Client Session::connect() const {
  if (!rigs.empty()) throw no_command_for_rigs();
  return client::Client({.address = server,
                         .timeout = std::chrono::milliseconds(std::llround(timeout_s * 1000.0)),
                         .certificates = certificates,
                         .lease_token = lease_token,
                         .acquires_lease = true,
                         .lease_purpose = command_line});
}

LocalError::LocalError(const std::string& what, const std::string& where, const std::string& value,
                       const std::string& limit, const std::string& remedy)
    : std::runtime_error(what), detail_(make_detail(what, where, value, limit, remedy)) {}

void print_json(const Json& document) {
  fmt::print("{}\n", document.dump(2));
}

void print_json_line(const Json& document) {
  fmt::print("{}\n", document.dump());
}

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
  print_error("error", "", error.detail(), session.json);
  return ExitCode::kUsage;
}

std::string read_text_file(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    const std::string reason = errno != 0 ? std::strerror(errno) : "it is a folder";
    throw LocalError("cannot read the file: " + reason, path);
  }
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace hapticd::cli
