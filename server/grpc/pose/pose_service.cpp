#include "server/grpc/pose/pose_service.h"

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "hal/lock/mutex.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/pose/pose_messages.h"
#include "server/pose/pose_publisher.h"
#include "server/process/system_clock.h"

namespace hapticd::server {

namespace {

/// Ends a call before it began.
class RefusedPoses final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedPoses(const Refusal& refusal) { Finish(to_status(refusal)); }
  void OnDone() override { delete this; }
};

/// Writes one pose at a time. While one is on its way the newest that is offered waits; each that comes after
/// it takes its place and is counted. Keeps itself alive until gRPC is done with it; the publisher only knows
/// it weakly.
class PoseStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                         public pose::PoseReceiver,
                         public std::enable_shared_from_this<PoseStream> {
 public:
  static grpc::ServerWriteReactor<grpc::ByteBuffer>* open(pose::PosePublisher& publisher,
                                                          const WantedPoses& wanted) {
    const auto stream = std::make_shared<PoseStream>();
    if (const ServedCall* call = served_call()) stream->place_ = call->place;
    if (const auto why = publisher.subscribe(wanted.pose, wanted.rate_hz, stream))
      return new RefusedPoses(*why);
    stream->self_ = stream;
    // Before any write: a buffered first write without it would wait without end.
    stream->StartSendInitialMetadata();
    return stream.get();
  }

  void offer(pose::IssuedPose& issued) override {
    if (issued.encoded.empty()) issued.encoded = encode(issued);
    const MutexLock lock(mutex_);
    if (finished_) return;
    if (writing_) {
      if (waiting_) ++skipped_;
      waiting_ = issued.encoded;
      return;
    }
    write_locked(issued.encoded);
  }

  void end(const Refusal& why) override {
    const MutexLock lock(mutex_);
    if (finished_) return;
    waiting_.reset();
    if (writing_) {
      ending_ = to_status(why);
    } else {
      finish_locked(to_status(why));
    }
  }

  void OnSendInitialMetadataDone(bool ok) override { written(ok); }
  void OnWriteDone(bool ok) override { written(ok); }

  void OnCancel() override {
    const MutexLock lock(mutex_);
    cancelled_ = true;
    if (!writing_) finish_locked(grpc::Status::CANCELLED);  // otherwise when the present write has failed
  }

  void OnDone() override {
    self_.reset();  // the last owner, unless the publisher is calling at this moment
  }

 private:
  void written(bool ok) {
    const MutexLock lock(mutex_);
    writing_ = false;
    if (!ok || cancelled_) return finish_locked(grpc::Status::CANCELLED);
    if (ending_) return finish_locked(*ending_);
    if (waiting_) write_locked(*std::exchange(waiting_, std::nullopt));
  }

  // Writes a message; what follows it counts as the same message: the stream's own fields come after those
  // that all share.
  void write_locked(const std::string& shared) REQUIRES(mutex_) {
    v1::Pose own;
    own.set_sent(++sent_);
    own.set_skipped(skipped_);
    own.set_handed_over_daemon_ns(monotonic_ns());
    grpc::Slice slices[] = {grpc::Slice(shared), grpc::Slice(own.SerializeAsString())};
    message_ = grpc::ByteBuffer(slices, 2);
    writing_ = true;
    StartWrite(&message_);
  }

  void finish_locked(const grpc::Status& status) REQUIRES(mutex_) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  std::shared_ptr<const void> place_;  ///< among the calls of its identity
  std::shared_ptr<PoseStream> self_;

  Mutex mutex_;  ///< between the publisher's thread and gRPC's; never of another stream
  grpc::ByteBuffer message_ GUARDED_BY(mutex_);
  std::optional<std::string> waiting_ GUARDED_BY(mutex_);  ///< the newest, while another is written
  std::optional<grpc::Status> ending_ GUARDED_BY(mutex_);  ///< when the present write is done
  std::uint64_t sent_ GUARDED_BY(mutex_) = 0;
  std::uint64_t skipped_ GUARDED_BY(mutex_) = 0;
  bool writing_ GUARDED_BY(mutex_) = true;  ///< the metadata are being sent
  bool cancelled_ GUARDED_BY(mutex_) = false;
  bool finished_ GUARDED_BY(mutex_) = false;
};

}  // namespace

grpc::ServerWriteReactor<grpc::ByteBuffer>* PoseService::Subscribe(grpc::CallbackServerContext*,
                                                                   const grpc::ByteBuffer* request) {
  v1::SubscribePosesRequest message;
  grpc::ByteBuffer bytes(*request);  // reading consumes it
  if (!grpc::SerializationTraits<v1::SubscribePosesRequest>::Deserialize(&bytes, &message).ok()) {
    return new RefusedPoses({RefusalKind::kInvalidArgument,
                             {"the request is no SubscribePosesRequest", "PoseService.Subscribe",
                              std::to_string(request->Length()) + " bytes", "",
                              "generate the client from this daemon's proto files"}});
  }
  const auto wanted = read_request(message);
  if (!wanted) return new RefusedPoses(wanted.refusal());
  return PoseStream::open(publisher_, *wanted);
}

}  // namespace hapticd::server
