#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {

/// A daemon that only identifies, by a script: what watching shows, when streams break, what is refused. It
/// listens on its own unix socket and can go away and come back there.
class IdentifyFakeService final : public v1::IdentificationService::Service {
 public:
  struct Script {
    /// Reported one after the other, at the same pace to all who watch; the last one is reported again and
    /// again while it is not over.
    std::vector<v1::IdentificationProgress> progress{};
    std::chrono::milliseconds pace{5};
    /// Streams end with `break_status` after so many messages each; 0 = they hold. The last of `progress` is
    /// not reported before all of them did, however slow the machine is.
    int break_after = 0;
    grpc::Status break_status = grpc::Status(grpc::StatusCode::UNAVAILABLE, "Socket closed");
    int streams_that_break = 1;
    /// Streams say nothing any more after so many messages; 0 = they go on.
    int silent_after = 0;
    int streams_that_fall_silent = 1;
    std::optional<grpc::Status> start_refusal{};
    std::optional<grpc::Status> watch_refusal{};
    /// Uploads are refused once so many bytes came.
    std::optional<std::size_t> upload_refused_after{};
    grpc::Status upload_refusal{};
    /// Bytes of an upload that are taken before the fake stops reading it; none = all.
    std::optional<std::size_t> upload_stalls_after{};
  };

  explicit IdentifyFakeService(Script script);
  ~IdentifyFakeService() override;

  std::string address() const { return "unix:" + folder_.path("fake.sock"); }
  /// Ends the server at once, streams and all; what runs goes on, as in a daemon behind a broken network.
  void disconnect();
  void listen();

  // What clients did.
  int watched() const { return static_cast<int>(watched_names().size()); }
  int cancelled() const { return locked(cancelled_); }
  std::vector<v1::StartIdentificationRequest> started() const { return locked(started_); }
  std::vector<std::string> watched_names() const { return locked(watched_names_); }
  std::vector<v1::UploadRecordingRequest> pieces() const { return locked(pieces_); }
  std::string uploaded() const { return locked(uploaded_); }  ///< the text of all pieces

  /// A refusal as the daemon makes it: a status with an ErrorDetail.
  static grpc::Status refusal(grpc::StatusCode code, const v1::ErrorDetail& detail);

 private:
  grpc::Status StartIdentification(grpc::ServerContext* context,
                                   const v1::StartIdentificationRequest* request,
                                   v1::StartIdentificationResponse* response) override;
  grpc::Status WatchIdentification(grpc::ServerContext* context,
                                   const v1::WatchIdentificationRequest* request,
                                   grpc::ServerWriter<v1::IdentificationProgress>* writer) override;
  grpc::Status CancelIdentification(grpc::ServerContext* context,
                                    const v1::CancelIdentificationRequest* request,
                                    v1::IdentificationProgress* response) override;
  grpc::Status ListIdentifications(grpc::ServerContext* context,
                                   const v1::ListIdentificationsRequest* request,
                                   v1::ListIdentificationsResponse* response) override;
  grpc::Status UploadRecording(grpc::ServerContext* context,
                               grpc::ServerReader<v1::UploadRecordingRequest>* reader,
                               v1::UploadRecordingResponse* response) override;

  template <class T>
  T locked(const T& value) const {
    const std::lock_guard lock(mutex_);
    return value;
  }
  /// What is reported now. `mutex_` held.
  bool streams_to_break() const;
  v1::IdentificationProgress now() const;

  TemporaryFolder folder_;
  Script script_;
  std::unique_ptr<grpc::Server> server_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool closing_ = false;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  bool cancel_asked_ = false;
  int cancelled_ = 0;
  int broken_streams_ = 0;
  int silent_streams_ = 0;
  std::vector<v1::StartIdentificationRequest> started_;
  std::vector<std::string> watched_names_;
  std::vector<v1::UploadRecordingRequest> pieces_;
  std::string uploaded_;
};

/// A running contact identification, as far along as `completion` says.
v1::IdentificationProgress contact_progress(double completion);
/// End of a contact identification.
v1::IdentificationProgress contact_end(v1::IdentificationState state);

}  // namespace hapticd::test
