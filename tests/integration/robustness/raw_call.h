#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <string>

#include "tests/integration/running_service.h"

namespace hapticd::test {

/// Answer to a call whose request is the bytes as they are, message or not: the first, if there are several.
struct RawAnswer {
  grpc::Status status;
  std::string bytes;
};

/// Makes a call of any kind. `waits`: for its end; otherwise the call is cancelled once it is answered, as a
/// stream would go on.
inline RawAnswer raw_call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                          const std::string& bytes, bool waits = true) {
  grpc::GenericStub stub(channel);
  grpc::CompletionQueue queue;
  const auto context = call_context();
  const auto call = stub.PrepareCall(context.get(), method, &queue);
  const auto done = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  call->StartCall(nullptr);
  done();
  const grpc::Slice slice(bytes);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  done();
  RawAnswer answer;
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  std::vector<grpc::Slice> slices;
  if (done() && response.Dump(&slices).ok()) {
    for (const grpc::Slice& one : slices) answer.bytes.append(one.begin(), one.end());
    if (!waits) context->TryCancel();
  }
  call->Finish(&answer.status, nullptr);
  done();
  return answer;
}

}  // namespace hapticd::test
