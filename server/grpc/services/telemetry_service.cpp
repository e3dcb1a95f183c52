#include "server/grpc/services/telemetry_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "hal/lock/mutex.h"
#include "server/grpc/calls/served_call.h"
#include "server/grpc/messages/enums.h"
#include "server/grpc/messages/status.h"
#include "server/grpc/messages/telemetry_encoding.h"
#include "server/telemetry/telemetry_hub.h"

namespace hapticd::server {

namespace {

/// A checked request.
struct Wanted {
  std::uint32_t channels = ~0U;
  bool as_block = false;
  SubscriptionOptions options;
};

/// Default size of a batch: samples of an undecimated stream, and their greatest age.
constexpr std::uint32_t kDefaultBatch = 20;
constexpr std::chrono::milliseconds kDefaultAge{20};

Refusal out_of_range(const char* field, std::uint32_t value, const char* limit) {
  return {RefusalKind::kOutOfRange,
          {fmt::format("{} is out of range", field), fmt::format("SubscribeRequest.{}", field),
           std::to_string(value), limit, "choose a value in the range, or 0 for the default"}};
}

/// "SAMPLE, MOTION, …"
std::string group_names() {
  std::string names;
  const auto& groups = *v1::FieldGroup_descriptor();
  for (int i = 1; i < groups.value_count(); ++i) {
    names += (i > 1 ? ", " : "") + groups.value(i)->name().substr(std::string_view("FIELD_GROUP_").size());
  }
  return names;
}

Outcome<Wanted> read_request(const v1::SubscribeRequest& request) {
  Wanted wanted;
  if (request.groups_size() > 0) wanted.channels = 0;
  for (int i = 0; i < request.groups_size(); ++i) {
    const v1::FieldGroup group = request.groups(i);
    if (!v1::FieldGroup_IsValid(group) || group == v1::FIELD_GROUP_UNSPECIFIED) {
      return Refusal{RefusalKind::kInvalidArgument,
                     {"unknown field group", fmt::format("SubscribeRequest.groups[{}]", i),
                      std::to_string(static_cast<int>(group)), group_names(),
                      "ask for groups of this list, or for none to get all"}};
    }
    wanted.channels |= channel_of(group);
  }
  if (!v1::TelemetryEncoding_IsValid(request.encoding())) {
    return Refusal{RefusalKind::kInvalidArgument,
                   {"unknown encoding", "SubscribeRequest.encoding",
                    std::to_string(static_cast<int>(request.encoding())), "SAMPLES or BLOCK",
                    "ask for one of these, or for none to get samples"}};
  }
  wanted.as_block = request.encoding() == v1::TELEMETRY_ENCODING_BLOCK;
  SubscriptionOptions& options = wanted.options;
  if (request.decimation() > 10000)
    return out_of_range("decimation", request.decimation(), "1 … 10000 ticks");
  if (request.batch_size() > 1000)
    return out_of_range("batch_size", request.batch_size(), "1 … 1000 samples");
  if (request.queue_samples() != 0 && (request.queue_samples() < 100 || request.queue_samples() > 60000)) {
    return out_of_range("queue_samples", request.queue_samples(), "100 … 60000 samples");
  }
  if (request.decimation() != 0) options.decimation = request.decimation();
  if (request.batch_size() != 0) {
    options.batch_size = request.batch_size();
  } else {
    options.batch_size = std::max(1U, kDefaultBatch / options.decimation);
    options.longest_wait = kDefaultAge;
  }
  if (request.queue_samples() != 0) options.queue_samples = request.queue_samples();
  // While one batch is written the next one is collected: with a shorter queue a fast reader would lose
  // samples too.
  options.queue_samples = std::max(options.queue_samples, 2 * options.batch_size);
  return wanted;
}

/// Ends a call before it began.
class RefusedStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer> {
 public:
  explicit RefusedStream(const Refusal& refusal) { Finish(to_status(refusal)); }
  void OnDone() override { delete this; }
};

/// Writes a subscription's batches, one at a time. Woken by the hub when a batch is ready and by gRPC when
/// the last one is on its way; the first to come writes. Keeps itself alive until gRPC is done with it;
/// the hub only knows it weakly, so that it may call at any moment.
class TelemetryStream final : public grpc::ServerWriteReactor<grpc::ByteBuffer>,
                              public std::enable_shared_from_this<TelemetryStream> {
 public:
  static TelemetryStream* open(TelemetryHub& hub, Wanted wanted) {
    const auto stream = std::make_shared<TelemetryStream>(hub, wanted);
    stream->self_ = stream;
    if (const ServedCall* call = served_call()) stream->place_ = call->place;
    wanted.options.on_ready = [weak = stream->weak_from_this()] {
      if (const auto alive = weak.lock()) alive->write_next();
    };
    stream->subscription_ = hub.subscribe(std::move(wanted.options));
    // Before any write: a buffered first write without it would wait without end.
    stream->StartSendInitialMetadata();
    return stream.get();
  }
  TelemetryStream(TelemetryHub& hub, const Wanted& wanted)
      : hub_(hub), channels_(wanted.channels), as_block_(wanted.as_block) {}

  void OnSendInitialMetadataDone(bool ok) override {
    {
      const MutexLock lock(mutex_);
      if (!ok) return finish_locked(grpc::Status::CANCELLED);
      writing_ = false;
    }
    write_next();
  }

  void OnWriteDone(bool ok) override {
    {
      const MutexLock lock(mutex_);
      writing_ = false;
      if (!ok || cancelled_) return finish_locked(grpc::Status::CANCELLED);
    }
    write_next();
  }

  void OnCancel() override {
    const MutexLock lock(mutex_);
    cancelled_ = true;
    if (!writing_) finish_locked(grpc::Status::CANCELLED);  // otherwise when the present write has failed
  }

  void OnDone() override {
    hub_.unsubscribe(subscription_);
    self_.reset();  // the last owner, unless the hub is calling at this moment
  }

 private:
  void write_next() {
    const MutexLock lock(mutex_);
    if (writing_ || finished_) return;
    if (!subscription_->take(batch_, Subscription::Clock::now())) {
      if (subscription_->ended()) {
        finish_locked(
            to_status({RefusalKind::kUnavailable,
                       {"the service is shutting down", "telemetry", "", "", "connect again later"}}));
      }
      return;
    }
    message_ = as_block_ ? encode_block(batch_, channels_, !std::exchange(described_, true))
                         : encode(batch_, channels_);
    batch_.entries.clear();
    writing_ = true;
    StartWrite(&message_);
  }

  void finish_locked(const grpc::Status& status) REQUIRES(mutex_) {
    if (std::exchange(finished_, true)) return;
    Finish(status);
  }

  TelemetryHub& hub_;
  const std::uint32_t channels_;
  std::shared_ptr<const void> place_;  ///< among the calls of its identity
  const bool as_block_;
  std::shared_ptr<TelemetryStream> self_;
  std::shared_ptr<Subscription> subscription_;

  Mutex mutex_;  ///< between the hub's thread and gRPC's; never of another stream
  Subscription::Batch batch_ GUARDED_BY(mutex_);
  grpc::ByteBuffer message_ GUARDED_BY(mutex_);
  bool writing_ GUARDED_BY(mutex_) = true;     ///< the metadata are being sent
  bool described_ GUARDED_BY(mutex_) = false;  ///< the columns of blocks were sent
  bool cancelled_ GUARDED_BY(mutex_) = false;
  bool finished_ GUARDED_BY(mutex_) = false;
};

}  // namespace

grpc::ServerWriteReactor<grpc::ByteBuffer>* TelemetryService::Subscribe(grpc::CallbackServerContext*,
                                                                        const grpc::ByteBuffer* request) {
  v1::SubscribeRequest message;
  grpc::ByteBuffer bytes(*request);  // reading consumes it
  if (!grpc::SerializationTraits<v1::SubscribeRequest>::Deserialize(&bytes, &message).ok()) {
    return new RefusedStream({RefusalKind::kInvalidArgument,
                              {"the request is no SubscribeRequest", "TelemetryService.Subscribe",
                               std::to_string(request->Length()) + " bytes", "",
                               "generate the client from this daemon's proto files"}});
  }
  auto wanted = read_request(message);
  if (!wanted) return new RefusedStream(wanted.refusal());
  return TelemetryStream::open(hub_, std::move(*wanted));
}

}  // namespace hapticd::server
