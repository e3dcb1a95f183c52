#include "client/cli/session/session.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

#include "client/cli/session/print.h"

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

/// Bytes of a file that is read as a whole, a table of telemetry at the largest.
constexpr std::size_t kMaxTextFile = std::size_t{1} << 30U;

/// Texts that are not UTF-8 would end the program.
std::string text_of(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
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

LocalError no_command_for_rigs() {
  return {"this command works on one rig", "--rigs", "", "status, doctor, stop",
          "name one rig with --server"};
}

client::ClientOptions Session::options() const {
  if (!rigs.empty()) throw no_command_for_rigs();
  return {.address = server,
          .timeout = std::chrono::milliseconds(std::llround(timeout_s * 1000.0)),
          .certificates = certificates,
          .lease_token = lease_token,
          .acquires_lease = true,
          .lease_purpose = command_line};
}

client::Client Session::connect() const {
  return client::Client(options());
}

LocalError::LocalError(const std::string& what, const std::string& where, const std::string& value,
                       const std::string& limit, const std::string& remedy)
    : std::runtime_error(what), detail_(make_detail(what, where, value, limit, remedy)) {}

void print_json(const Json& document) {
  print_text(text_of(document, 2));
}

void print_json_line(const Json& document) {
  print_line(text_of(document, -1));
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
  std::string text;
  std::string piece(std::size_t{1} << 20U, '\0');
  while (file) {
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    text.append(piece, 0, static_cast<std::size_t>(file.gcount()));
    if (text.size() > kMaxTextFile) {
      throw LocalError("the file is too large", path, "", fmt::format("at most {} MB", kMaxTextFile >> 20U));
    }
  }
  return text;
}

}  // namespace hapticd::cli
