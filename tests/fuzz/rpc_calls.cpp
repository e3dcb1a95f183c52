// Calls every method of the contract with requests made up from its descriptors: wrong numbers, absent and
// repeated fields, bytes that are not a message. The daemon runs in this process, so whatever breaks it
// breaks this. The same seed makes the same requests.
//
//   fuzz_rpc_calls [CALLS [SEED]]

#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/stubs/logging.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "hapticd/v1/access.grpc.pb.h"
#include "hapticd/v1/rig.grpc.pb.h"
#include "server/config/config.h"
#include "server/daemon.h"

namespace {

using namespace hapticd;
using google::protobuf::Descriptor;
using google::protobuf::DescriptorPool;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr std::chrono::milliseconds kTimeout{300};
constexpr std::chrono::seconds kLastCallTimeout{60};

/// Requests by a seed.
class RequestMaker {
 public:
  explicit RequestMaker(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  bool chance(double share) { return std::uniform_real_distribution<double>(0.0, 1.0)(random_) < share; }

  /// The bytes of a request; mostly a message of its type, sometimes not.
  std::string make(const Descriptor& type) {
    const std::unique_ptr<Message> message(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
    fill(*message, 0);
    std::string bytes = message->SerializeAsString();
    if (chance(0.15)) spoil(bytes);
    if (chance(0.003)) bytes.append(std::size_t{3} << 20U, '\x0a');
    return bytes;
  }

 private:
  static constexpr int kMaxDepth = 4;

  double number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNumbers[] = {0.0,        -0.0, 1.0,   -1.0,  0.3,    5.0,      100.0,
                                   1e3,        -1e3, 1e-9,  1e308, -1e308, 5e-324,   kInfinity,
                                   -kInfinity, NAN,  0.001, 20.0,  1e18,   1.0000001};
    return kNumbers[below(std::size(kNumbers))];
  }
  std::int64_t integer() {
    constexpr std::int64_t kIntegers[] = {0,
                                          1,
                                          -1,
                                          2,
                                          7,
                                          16,
                                          100,
                                          1000,
                                          65536,
                                          2147483647,
                                          -2147483648LL,
                                          std::numeric_limits<std::int64_t>::max(),
                                          std::numeric_limits<std::int64_t>::min(),
                                          5'000'000'000};
    return kIntegers[below(std::size(kIntegers))];
  }
  std::string text() {
    static const std::vector<std::string> kTexts{"",
                                                 "tap_1d",
                                                 "explore_rod",
                                                 "wall",
                                                 "sponge_cut",
                                                 "sponge_block",
                                                 "none",
                                                 "rod",
                                                 "contact",
                                                 "contact-1",
                                                 "recording-1",
                                                 "current",
                                                 "sponge_cut@current",
                                                 "x",
                                                 "force",
                                                 "rm",
                                                 "../../etc/passwd",
                                                 "a\nb",
                                                 std::string("nul\0nul", 7),
                                                 "Übersteuert 力 🖐",
                                                 "0123456789abcdef",
                                                 "{\"content\": {}}",
                                                 "name = \"a\"\nkind = \"tap_1d\"\n",
                                                 "time_s,force_N,position_mm\n0,0,0\n1,1,1\n"};
    switch (below(8)) {
      case 0:
        return std::string(below(100'000), 'x');
      case 1: {
        std::string keys = "a";  // keys of many parts, in TOML
        for (std::size_t i = below(40'000); i > 0; --i) keys += ".a";
        return keys + " = 1";
      }
      case 2:
        return std::string(below(3'000), '[');
      default:
        return kTexts[below(kTexts.size())];
    }
  }

  void fill(Message& message, int depth) {
    const Descriptor& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      if (!chance(depth == 0 ? 0.7 : 0.5)) continue;
      if (!field.is_repeated()) {
        set(message, field, depth);
        continue;
      }
      for (std::size_t n = chance(0.05) ? 2'000 : below(4); n > 0; --n) add(message, field, depth);
    }
  }
  void set(Message& message, const FieldDescriptor& field, int depth) {
    const auto& access = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return access.SetDouble(&message, &field, number());
      case FieldDescriptor::CPPTYPE_FLOAT:
        return access.SetFloat(&message, &field, static_cast<float>(number()));
      case FieldDescriptor::CPPTYPE_INT32:
        return access.SetInt32(&message, &field, static_cast<std::int32_t>(integer()));
      case FieldDescriptor::CPPTYPE_INT64:
        return access.SetInt64(&message, &field, integer());
      case FieldDescriptor::CPPTYPE_UINT32:
        return access.SetUInt32(&message, &field, static_cast<std::uint32_t>(integer()));
      case FieldDescriptor::CPPTYPE_UINT64:
        return access.SetUInt64(&message, &field, static_cast<std::uint64_t>(integer()));
      case FieldDescriptor::CPPTYPE_BOOL:
        return access.SetBool(&message, &field, chance(0.5));
      case FieldDescriptor::CPPTYPE_ENUM:
        return access.SetEnumValue(&message, &field, static_cast<int>(below(20)) - (chance(0.1) ? 100 : 0));
      case FieldDescriptor::CPPTYPE_STRING:
        return access.SetString(&message, &field, text());
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kMaxDepth) fill(*access.MutableMessage(&message, &field), depth + 1);
        return;
    }
  }
  void add(Message& message, const FieldDescriptor& field, int depth) {
    const auto& access = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return access.AddDouble(&message, &field, number());
      case FieldDescriptor::CPPTYPE_ENUM:
        return access.AddEnumValue(&message, &field, static_cast<int>(below(20)));
      case FieldDescriptor::CPPTYPE_STRING:
        return access.AddString(&message, &field, text().substr(0, 100));
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kMaxDepth) fill(*access.AddMessage(&message, &field), depth + 1);
        return;
      default:
        return;  // the contract repeats no others in requests
    }
  }
  void spoil(std::string& bytes) {
    switch (below(3)) {
      case 0:
        bytes.resize(below(bytes.size() + 1));
        return;
      case 1:
        bytes.insert(below(bytes.size() + 1), "\x0a\x04\xfc\x62\x65\x72");  // a string that is not UTF-8
        return;
      default:
        for (std::size_t n = 1 + below(4); n > 0 && !bytes.empty(); --n) {
          char& byte = bytes[below(bytes.size())];
          byte = static_cast<char>(byte ^ (1 << below(8)));
        }
    }
  }

  std::mt19937_64 random_;
};

std::vector<const MethodDescriptor*> methods_of_the_contract() {
  std::vector<const MethodDescriptor*> methods;
  for (const char* name : {"Rig", "Scene", "Model", "Rendering", "Telemetry", "Simulation", "Identification",
                           "Turntable", "Safety", "Access"}) {
    std::string file = name;
    file[0] = static_cast<char>(file[0] - 'A' + 'a');
    const auto* found = DescriptorPool::generated_pool()->FindFileByName("hapticd/v1/" + file + ".proto");
    for (int s = 0; found != nullptr && s < found->service_count(); ++s) {
      for (int m = 0; m < found->service(s)->method_count(); ++m)
        methods.push_back(found->service(s)->method(m));
    }
  }
  return methods;
}

/// True for methods that take a quarter of a second or more each time they are served.
bool takes_long(const std::string& method) {
  return method == "Diagnose" || method == "BiasForceSensor" || method == "Home" ||
         method == "ExplainScene" || method == "MoveTo" || method == "WatchIdentification" ||
         method == "WatchLease" || method == "Subscribe";
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
      // For the turntable and the sensor it is an answer; the service has none.
      return status.error_details().empty() ? "the service is gone" : "";
    case grpc::StatusCode::INTERNAL:
      return is_ours && status.error_details().empty() ? "an error inside, or without a word" : "";
    default:
      return "";
  }
}

}  // namespace

int main(int argc, char** argv) {
  const long calls = argc > 1 ? std::atol(argv[1]) : 1000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1);

  google::protobuf::SetLogHandler(nullptr);  // it shows each string that is not UTF-8

  server::DaemonConfig config;
  config.listen.port = 0;
  config.log_level = server::LogLevel::kError;
  config.model_store = ":memory:";
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
  for (long i = 0; i < calls; ++i) {
    const MethodDescriptor& method = *methods[maker.below(methods.size())];
    if (takes_long(method.name()) && !maker.chance(0.1)) continue;
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
    std::fprintf(stderr, "seed %llu, call %ld, %s: %s (%d: %s)\n", static_cast<unsigned long long>(seed), i,
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
  long inputs = 0;
  for (const auto& [code, count] : ended) inputs += count;
  std::printf("%ld inputs, %d failures; %zu of %zu methods called, seed %llu; ended as", inputs,
              complaints + (sound ? 0 : 1), called.size(), methods.size(),
              static_cast<unsigned long long>(seed));
  for (const auto& [code, count] : ended) std::printf(" %d: %ld", code, count);
  std::printf("\n");
  return complaints == 0 && sound ? 0 : 1;
}
