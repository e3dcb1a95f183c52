// Calls every method of the contract with requests made up from its descriptors: wrong numbers, absent and
// repeated fields, bytes that are not a message. The daemon runs in this process, so whatever breaks it breaks
// this. The same seed makes the same requests.
//
//   fuzz_rpc_calls [INPUTS [SEED]]     without them HAPTICD_INPUTS and HAPTICD_SEED, or 10000 and 1

#include <google/protobuf/stubs/logging.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "hapticd/v1/access.grpc.pb.h"
#include "hapticd/v1/rig.grpc.pb.h"
#include "server/access/access_table.h"
#include "server/config/config.h"
#include "server/daemon.h"
#include "tests/fuzz/requests/request_maker.h"
#include "tests/support/temporary_folder.h"

namespace {

using namespace hapticd;
using fuzz::RequestMaker;
using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr std::chrono::milliseconds kTimeout{300};
constexpr std::chrono::seconds kLastCallTimeout{60};

/// All of them: a test compares the table with the contract.
std::vector<const MethodDescriptor*> methods_of_the_contract() {
  std::vector<const MethodDescriptor*> methods;
  for (const server::AccessRow& row : server::kAccessTable) {
    std::string name = "hapticd.v1." + std::string(row.method);
    name.replace(name.find('/'), 1, ".");
    methods.push_back(DescriptorPool::generated_pool()->FindMethodByName(name));
  }
  return methods;
}

/// Returns true for methods that take a quarter of a second or more each time they are served.
bool takes_long(const MethodDescriptor& method) {
  const std::string& name = method.name();
  return method.server_streaming() || name == "Diagnose" || name == "BiasForceSensor" || name == "Home" ||
         name == "HomeDevice" || name == "ExplainScene" || name == "MoveTo" || name == "MoveTool";
}

long number_from(const char* argument, const char* variable, long otherwise) {
  if (argument == nullptr) argument = std::getenv(variable);
  return argument == nullptr ? otherwise : std::atol(argument);
}

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return {&slice, 1};
}

std::string bytes_of(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  std::string bytes;
  if (!buffer.Dump(&slices).ok()) return bytes;
  for (const grpc::Slice& slice : slices) {
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return bytes;
}

/// One call of any kind: its requests, a few of its answers, and how it ended. `token`: of a lease, or none.
/// `first_answer`: filled.
grpc::Status call(grpc::GenericStub& stub, const std::string& method,
                  const std::vector<std::string>& requests, const std::string& token,
                  std::string& first_answer) {
  grpc::ClientContext context;
  if (!token.empty()) context.AddMetadata("hapticd-lease", token);
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  grpc::CompletionQueue queue;
  const auto next = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  const auto stream = stub.PrepareCall(&context, method, &queue);
  stream->StartCall(nullptr);
  bool open = next();
  for (std::size_t i = 0; open && i < requests.size(); ++i) {
    stream->Write(buffer_of(requests[i]), nullptr);
    open = next();
  }
  if (open) {
    stream->WritesDone(nullptr);
    open = next();
  }
  constexpr int kMaxAnswers = 3;
  for (int i = 0; open && i < kMaxAnswers; ++i) {
    grpc::ByteBuffer answer;
    stream->Read(&answer, nullptr);
    open = next();
    if (open && i == 0) first_answer = bytes_of(answer);
  }
  if (open) context.TryCancel();
  grpc::Status status;
  stream->Finish(&status, nullptr);
  next();
  return status;
}

bool is_message(const Descriptor& type, const std::string& bytes) {
  const std::unique_ptr<Message> message(
      google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
  return message->ParseFromString(bytes);
}

/// What no request may lead to. `is_ours`: gRPC does not answer on its own.
std::string complaint(const grpc::Status& status, bool is_ours) {
  switch (status.error_code()) {
    case grpc::StatusCode::UNKNOWN:
      return "an exception reached gRPC";
    case grpc::StatusCode::UNIMPLEMENTED:
      return "the method is not there";
    case grpc::StatusCode::UNAVAILABLE:
      // The turntable and the sensor answer so, with details; the service that is gone has none.
      return status.error_details().empty() ? "the service is gone" : "";
    case grpc::StatusCode::INTERNAL:
      return is_ours && status.error_details().empty() ? "an error inside, or without a word" : "";
    default:
      return "";
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long inputs = number_from(argc > 1 ? argv[1] : nullptr, "HAPTICD_INPUTS", 10'000);
  const auto seed = static_cast<std::uint64_t>(number_from(argc > 2 ? argv[2] : nullptr, "HAPTICD_SEED", 1));

  google::protobuf::SetLogHandler(nullptr);  // it shows each string that is not UTF-8

  const test::TemporaryFolder folder;
  server::DaemonConfig config;
  config.listen.port = 0;
  config.log_level = server::LogLevel::kError;
  config.model_store = ":memory:";
  config.recording.folder = folder.path();
  config.recording.quota_mb = config.recording.incident_quota_mb = 200.0;
  config.recording.when_full = server::WhenFull::kRemoveOldest;
  config.scene = "tap_1d";
  config.access.take_notice_s = 0.0;
  const auto checked = server::override_config(config, {});
  server::StartFailure failure;
  const auto daemon = checked ? server::Daemon::start(*checked, failure) : nullptr;
  if (!daemon) {
    std::fprintf(stderr, "the daemon does not start: %s\n", failure.error.text().c_str());
    return 1;
  }
  const auto channel =
      grpc::CreateChannel("127.0.0.1:" + std::to_string(daemon->port()), grpc::InsecureChannelCredentials());
  grpc::GenericStub stub(channel);

  const auto methods = methods_of_the_contract();
  RequestMaker maker(seed);
  std::map<int, long> ended;
  std::map<std::string, long> called;
  int complaints = 0;
  std::string token;  ///< of the lease that was granted last
  for (long i = 0; i < inputs;) {
    const MethodDescriptor& method = *methods[maker.below(methods.size())];
    if (takes_long(method) && !maker.chance(0.1)) continue;
    ++i;
    const std::string path = "/" + method.service()->full_name() + "/" + method.name();
    std::vector<std::string> requests;
    bool is_well_formed = true;
    for (std::size_t n = method.client_streaming() ? 1 + maker.below(3) : 1; n > 0; --n) {
      requests.push_back(maker.make(*method.input_type()));
      is_well_formed = is_well_formed && is_message(*method.input_type(), requests.back());
    }
    // Mostly as the holder of the lease, if there is one: else most commands would end at the gate.
    std::string answer;
    const std::string shown = maker.chance(0.05) ? std::string(maker.below(5000), 'x') : token;
    const grpc::Status status = call(stub, path, requests, maker.chance(0.1) ? "" : shown, answer);
    v1::LeaseGrant grant;
    const bool grants = method.output_type() == v1::LeaseGrant::descriptor();
    if (status.ok() && grants && grant.ParseFromString(answer)) token = grant.token();
    if (status.ok() && method.name() == "ReturnLease") token.clear();
    ++ended[status.error_code()];
    ++called[path];
    const std::string wrong = complaint(status, is_well_formed || !method.client_streaming());
    if (wrong.empty()) continue;
    ++complaints;
    std::fprintf(stderr, "seed %llu, input %ld, %s: %s (%d: %s)\n", static_cast<unsigned long long>(seed), i,
                 path.c_str(), wrong.c_str(), static_cast<int>(status.error_code()),
                 status.error_message().c_str());
  }

  // After all that it works, and what it shows are numbers.
  v1::RigState state;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kLastCallTimeout);
  const grpc::Status status = v1::RigService::NewStub(channel)->GetRigState(&context, {}, &state);
  const bool sound = status.ok() && state.loop().running() &&
                     std::isfinite(state.target_stiffness_n_per_mm()) &&
                     std::isfinite(state.reaction_force_n()) && std::isfinite(state.hand_force_n());
  if (!sound) {
    std::fprintf(stderr, "afterwards: %s\n%s\n", status.error_message().c_str(),
                 state.ShortDebugString().substr(0, 2000).c_str());
  }
  std::printf("%ld inputs, %d failures; %zu of %zu methods called, seed %llu; ended as", inputs,
              complaints + (sound ? 0 : 1), called.size(), methods.size(),
              static_cast<unsigned long long>(seed));
  for (const auto& [code, count] : ended) std::printf(" %d: %ld", code, count);
  std::printf("\n");
  return complaints == 0 && sound ? 0 : 1;
}
