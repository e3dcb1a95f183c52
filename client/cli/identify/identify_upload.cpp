#include "client/cli/identify/identify_upload.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPollInterval{50};
constexpr std::uint64_t kReadPerSecond = std::uint64_t{4} << 20;
constexpr std::size_t kMaxName = 200;

std::ifstream open(const std::string& path, std::optional<std::uint64_t>& size) {
  std::error_code failure;
  if (std::filesystem::is_directory(path, failure)) {
    throw LocalError("cannot read the recording: it is a folder", path);
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    throw LocalError(std::string("cannot read the recording: ") +
                         (errno != 0 ? std::strerror(errno) : "it cannot be opened"),
                     path);
  }
  if (std::filesystem::is_regular_file(path, failure)) {
    const auto bytes = std::filesystem::file_size(path, failure);
    if (!failure) size = bytes;
  }
  return file;
}

client::Error stalled(const std::string& address) {
  v1::ErrorDetail detail;
  detail.set_what("the daemon does not take the recording");
  detail.set_where(address);
  detail.set_remedy("allow a longer timeout, or look at the daemon's log");
  return {client::ErrorKind::kTimedOut, "", detail};
}

/// Asks `done` until it is true; stops when interrupted, or after `at_most`.
template <class Done>
void wait_for(Done done, std::chrono::milliseconds at_most, const UploadState& state,
              const UploadOptions& options, const std::string& address) {
  const auto until = Clock::now() + at_most;
  while (!done()) {
    if (options.on_progress) options.on_progress(state);
    if (options.interrupted && options.interrupted()) throw LocalError("interrupted");
    if (Clock::now() > until) throw stalled(address);
  }
}

/// Length of the UTF-8 character at the start, 0 if there is none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = byte(0) < 0x80    ? 1
                             : byte(0) < 0xc2  ? 0
                             : byte(0) < 0xe0  ? 2
                             : byte(0) < 0xf0  ? 3
                             : byte(0) <= 0xf4 ? 4
                                               : 0;
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0U) != 0x80U) return 0;
  }
  // Written longer than need be, halves of pairs, and beyond the last character.
  if (length > 2) {
    const unsigned first = byte(0);
    const unsigned second = byte(1);
    if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
        (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f)) {
      return 0;
    }
  }
  return length;
}

}  // namespace

double UploadState::mb_per_s() const {
  return elapsed.count() > 0.0 ? 1e-6 * static_cast<double>(sent_bytes) / elapsed.count() : 0.0;
}

std::string recording_name(const std::string& path) {
  const std::string file_name = std::filesystem::path(path).filename().string();
  std::string_view rest = file_name.empty() ? std::string_view(path) : std::string_view(file_name);
  std::string name;
  for (std::size_t characters = 0; !rest.empty() && characters < kMaxName; ++characters) {
    const std::size_t length = character_length(rest);
    const bool control = length == 1 && (static_cast<unsigned char>(rest[0]) < 0x20 || rest[0] == 0x7f);
    if (length == 0 || control) {
      name += '?';
    } else {
      name += rest.substr(0, length);
    }
    rest.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return name;
}

v1::UploadRecordingResponse upload_file(client::Client& client, const std::string& path,
                                        const v1::RecordingDescription& description,
                                        const UploadOptions& options) {
  UploadState state;
  std::ifstream file = open(path, state.total_bytes);
  client::RecordingUpload upload = client.upload_recording(description);
  const auto began = Clock::now();
  std::string piece(client::RecordingUpload::kMaxPiece, '\0');
  while (file) {
    piece.resize(client::RecordingUpload::kMaxPiece);
    file.read(piece.data(), static_cast<std::streamsize>(piece.size()));
    piece.resize(static_cast<std::size_t>(file.gcount()));
    if (piece.empty()) break;
    const std::uint64_t bytes = piece.size();
    upload.send(std::move(piece));
    wait_for([&upload] { return upload.taken(kPollInterval); }, options.timeout, state, options,
             client.address());
    state.sent_bytes += bytes;
    state.elapsed = Clock::now() - began;
    if (options.on_progress) options.on_progress(state);
  }
  if (file.bad()) throw LocalError("the recording could not be read to its end", path);
  if (state.sent_bytes == 0) throw LocalError("there is nothing in the recording", path);

  upload.finish();
  state.sent = true;
  const std::chrono::seconds reading(state.sent_bytes / kReadPerSecond);
  std::optional<v1::UploadRecordingResponse> answer;
  wait_for(
      [&] {
        answer = upload.answer(kPollInterval);
        return answer.has_value();
      },
      options.timeout + reading, state, options, client.address());
  return *answer;
}

}  // namespace hapticd::cli
