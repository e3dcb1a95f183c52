// A data race in a call that gRPC serves. Under ThreadSanitizer it has to be reported in spite of what
// thread_suppressions.txt hides: a test looks for it.

#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace {

int unguarded_calls = 0;

class CountingCall : public grpc::ServerGenericBidiReactor {
 public:
  CountingCall() {
    for (int i = 0; i < 1000; ++i) ++unguarded_calls;
    Finish(grpc::Status::OK);
  }
  void OnDone() override { delete this; }
};

class CountingService : public grpc::CallbackGenericService {
 public:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new CountingCall;
  }
};

void call(int port) {
  const auto channel = grpc::CreateCustomChannel("127.0.0.1:" + std::to_string(port),
                                                 grpc::InsecureChannelCredentials(), grpc::ChannelArguments());
  grpc::GenericStub stub(channel);
  for (int i = 0; i < 50; ++i) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const auto reader = stub.PrepareUnaryCall(&context, "/test/Count", grpc::ByteBuffer(), &queue);
    reader->StartCall();
    grpc::ByteBuffer response;
    grpc::Status status;
    reader->Finish(&response, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
  }
}

}  // namespace

int main() {
  CountingService service;
  grpc::ServerBuilder builder;
  int port = 0;
  builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
  builder.RegisterCallbackGenericService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) clients.emplace_back(call, port);
  for (std::thread& client : clients) client.join();
  server->Shutdown();
  std::printf("%d calls counted\n", unguarded_calls / 1000);
  return 0;
}
