#include "client/cli/session/session.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

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

/// Texts that are not UTF-8 would end the program.
std::string text_of(const Json& document, int indent) {
  return document.dump(indent, ' ', false, Json::error_handler_t::replace);
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
                       const std::string& limit, const std::string& remedy, v1::ErrorReason reason)
    : std::runtime_error(what), detail_(make_detail(what, where, value, limit, remedy)) {
  detail_.set_reason(reason);
}

void print_json(const Json& document) {
  print_text(text_of(document, 2));
}

void print_json_line(const Json& document) {
  print_line(text_of(document, -1));
}

std::string read_text_file(const std::string& path, std::size_t max_bytes) {
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
    if (text.size() > max_bytes) {
      throw LocalError("the file is too large", path, "", fmt::format("at most {} MiB", max_bytes >> 20U));
    }
  }
  return text;
}

}  // namespace hapticd::cli
