#pragma once

// Internal to the library: the gRPC side of a call that the daemon answers with many messages.

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "client/cpp/error.h"
#include "client/cpp/message_stream.h"

namespace hapticd::client {

/// Reads a stream of messages with a bounded wait. One operation is under way at any time, so the completion
/// queue needs no tags to distinguish them. Destroying it cancels the call.
template <class Message>
class ServerStream {
 public:
  using Event = typename MessageStream<Message>::Event;

  /// `begin(stub, context, queue)` starts the call and returns its reader; `address` is for errors.
  template <class Stub, class Begin>
  ServerStream(const std::shared_ptr<Stub>& stub, std::string address, Begin begin)
      : address_(std::move(address)), stub_(stub), reader_(begin(*stub, &context_, &queue_)) {}

  ~ServerStream() {
    context_.TryCancel();
    bool succeeded = false;
    if (phase_ == Phase::kStarting || phase_ == Phase::kReading) {
      await(std::chrono::hours(1), succeeded);
      reader_->Finish(&status_, nullptr);
      phase_ = Phase::kFinishing;
    }
    if (phase_ == Phase::kFinishing) await(std::chrono::hours(1), succeeded);
    queue_.Shutdown();
    void* tag = nullptr;
    while (queue_.Next(&tag, &succeeded)) {
    }
  }
  ServerStream(const ServerStream&) = delete;
  ServerStream& operator=(const ServerStream&) = delete;

  /// Waits up to `wait` for the next message. Throws Error when the call was refused or the connection broke.
  Event next(Message& message, std::chrono::milliseconds wait) {
    const auto until = std::chrono::steady_clock::now() + wait;
    while (phase_ != Phase::kDone) {
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      bool succeeded = false;
      if (!await(std::max(left, std::chrono::milliseconds(0)), succeeded)) return Event::kNothing;

      if (phase_ == Phase::kFinishing) {
        phase_ = Phase::kDone;
        if (!status_.ok() && !cancelled_) {
          throw error_from_status(static_cast<int>(status_.error_code()), status_.error_message(),
                                  status_.error_details(), address_);
        }
      } else if (!succeeded) {
        phase_ = Phase::kFinishing;
        reader_->Finish(&status_, nullptr);
      } else if (phase_ == Phase::kStarting) {
        phase_ = Phase::kReading;
        reader_->Read(&incoming_, nullptr);
      } else {
        message.Swap(&incoming_);
        incoming_.Clear();
        reader_->Read(&incoming_, nullptr);
        return Event::kMessage;
      }
    }
    return Event::kEnded;
  }

  void cancel() {
    cancelled_ = true;
    context_.TryCancel();
  }

 private:
  enum class Phase { kStarting, kReading, kFinishing, kDone };

  /// Waits for the one operation under way. False when `wait` passed first.
  bool await(std::chrono::milliseconds wait, bool& succeeded) {
    void* tag = nullptr;
    return queue_.AsyncNext(&tag, &succeeded, std::chrono::system_clock::now() + wait) ==
           grpc::CompletionQueue::GOT_EVENT;
  }

  std::string address_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  Message incoming_;
  grpc::Status status_;
  Phase phase_ = Phase::kStarting;
  bool cancelled_ = false;
  std::shared_ptr<void> stub_;  ///< lives as long as its call
  std::unique_ptr<grpc::ClientAsyncReader<Message>> reader_;
};

}  // namespace hapticd::client
