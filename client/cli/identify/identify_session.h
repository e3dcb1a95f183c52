#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "client/cli/identify/identify_follow.h"
#include "client/cli/session/session.h"
#include "client/cli/view/live_screen.h"

namespace hapticd::cli {

/// What the user asks of a running command from outside.
enum class UserRequest {
  kGoOn,
  kCancel,  ///< Ctrl-C
  kLeave,   ///< SIGTERM: the client ends, the identification goes on
};

struct IdentifyOptions {
  bool adopt = false;   ///< as requested at the start; the report says what follows
  bool detach = false;  ///< start and exit
  std::string svg{};    ///< where to draw fit and coverage at the end; empty = nowhere
  std::chrono::milliseconds timeout{30000};
  std::function<UserRequest()> user_request{};  ///< none = by the signals that came
};

/// The commands that run, watch and end identifications. They print, and set the exit code of the session.
/// They throw client::Error and LocalError.
class IdentifySession {
 public:
  IdentifySession(Session& session, IdentifyOptions options);

  /// Uploads the recording, if there is a path to one, starts, and watches to the end (unless detached);
  /// Ctrl-C cancels the identification. `reference_path`: of the object without its inclusion, described as
  /// the other one, but for its name.
  void start(v1::StartIdentificationRequest request, const std::string& recording_path,
             const v1::RecordingDescription& description, const std::string& reference_path = {});
  /// Watches one that runs or is over; Ctrl-C leaves it running.
  void watch(const std::string& identification);
  void cancel(const std::string& identification);
  void list();

 private:
  std::string upload(const std::string& path, const v1::RecordingDescription& description);
  IdentifyEnd follow(const std::string& identification);
  v1::IdentificationProgress cancel_now(const std::string& identification);
  void show(const v1::IdentificationProgress& progress);
  void show_frame(const std::string& notice);
  void say(const std::string& line) const;
  void conclude(const v1::IdentificationProgress& progress);
  UserRequest user_request() const;

  Session& session_;
  IdentifyOptions options_;
  client::Client client_;
  LiveScreen screen_;
  bool live_ = false;
  std::optional<v1::IdentificationProgress> last_;
  std::chrono::steady_clock::time_point next_line_{};
  bool notice_reported_ = false;
};

}  // namespace hapticd::cli
