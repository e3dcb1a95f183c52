#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "hapticd/v1/identification.pb.h"

namespace hapticd::client {

/// Sends a recording (CSV text, up to 2 GiB) piece by piece, as fast as the daemon takes it. Only one piece
/// is held here. Destroying it before the answer gives the upload up. Use it from one thread.
///
///     auto upload = client.upload_recording(description);
///     while (read(piece)) {
///       upload.send(std::move(piece));
///       while (!upload.taken(50ms)) show_progress();
///     }
///     upload.finish();
///     while (!(answer = upload.answer(50ms))) show_progress();
class RecordingUpload {
 public:
  /// What a piece should be at most, in bytes: well below the 1 MiB that a message may have.
  static constexpr std::size_t kMaxPiece = std::size_t{1} << 18;

  RecordingUpload(RecordingUpload&&) noexcept;
  RecordingUpload& operator=(RecordingUpload&&) noexcept;
  ~RecordingUpload();

  /// The next piece of the text, at most kMaxPiece, once the last one was taken.
  void send(std::string csv);
  /// Waits up to `wait` until the last piece was taken; false if it was not yet. Throws Error when the
  /// connection broke (kUnreachable) or the daemon refuses the recording, which it may do before the end:
  /// INVALID, TOO_MANY (too large, no space, or 4 uploads already), and with code() CANCELLED if no piece
  /// came for 30 s.
  bool taken(std::chrono::milliseconds wait);
  /// Call it after the last piece. Nothing may be sent after it.
  void finish();
  /// Waits up to `wait` for the daemon's answer: the recording's id, rows and duration. Empty if none came
  /// yet; throws like taken().
  std::optional<v1::UploadRecordingResponse> answer(std::chrono::milliseconds wait);

 private:
  friend class Client;
  struct State;
  explicit RecordingUpload(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::client
