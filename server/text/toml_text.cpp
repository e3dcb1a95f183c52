#include "server/text/toml_text.h"

#include <fmt/format.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace hapticd::server {

namespace {

constexpr std::size_t kMaxFile = std::size_t{1} << 20U;

}  // namespace

hal::Result<std::string> read_text_file(const std::string& path) {
  // Opening a named pipe without a writer would wait; one of a shell (/dev/fd/63) has one.
  std::error_code ignored;
  if (std::filesystem::is_fifo(std::filesystem::symlink_status(path, ignored))) {
    return hal::Error::of(hal::ErrorCode::kUnreadable, "cannot read the file", path, "a pipe",
                          "a regular file", "check the path");
  }
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    const hal::ErrorCode code = errno == ENOENT ? hal::ErrorCode::kNotFound : hal::ErrorCode::kUnreadable;
    return hal::Error{"cannot read the file",       path, std::string(std::strerror(errno)), "",
                      "check path and permissions", code};
  }
  std::string text(kMaxFile + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (file.gcount() == 0 && !file.eof())) {
    return hal::Error::of(hal::ErrorCode::kUnreadable, "cannot read the file", path, "", "a regular file",
                          "check path and permissions");
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxFile) {
    return hal::Error::of(hal::ErrorCode::kTooLong, "the file is too large", path, "more than 1 MiB",
                          "at most 1 MiB", "shorten it");
  }
  return text;
}

std::string toml_quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (byte < 0x20 || byte == 0x7f) {
      quoted += fmt::format("\\u{:04X}", static_cast<unsigned>(byte));
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string toml_number(double value) {
  // {} is the shortest text that reads back; TOML shows 1.0 from 1, and 1e-05 is a number to both.
  std::string text = fmt::format("{}", value);
  if (std::isfinite(value) && text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string toml_vector(const hal::Vector3& v) {
  return fmt::format("[{}, {}, {}]", toml_number(v.x), toml_number(v.y), toml_number(v.z));
}

}  // namespace hapticd::server
