// However busy the service is: stop and clear are served, memory has a bound.

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>

#include <atomic>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <thread>

#include "hapticd/v1/access.grpc.pb.h"
#include "hapticd/v1/turntable.grpc.pb.h"
#include "tests/integration/daemon_process.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"
#include "tests/support/eventually.h"
#include "tests/support/http2_flood.h"
#include "tests/support/process_memory.h"
#include "tests/support/sanitizer.h"
#include "tests/support/system/loopback.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

/// Keeps so many calls of one kind under way, each ended one followed by another, until it is asked to stop.
class Flood {
 public:
  struct Counts {
    int served = 0;
    int refused_with_detail = 0;
    int refused_by_the_pool = 0;  ///< gRPC's own word, without detail
    int otherwise = 0;
    std::string first_otherwise;
  };

  template <class Start>
  Flood(const std::string& address, int calls, Start start)
      : client_(connect(address)), start_(std::move(start)) {
    for (int i = 0; i < calls; ++i) begin();
    thread_ = std::thread([this] { run(); });
  }
  ~Flood() {
    if (thread_.joinable()) stop();
  }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  Counts stop() {
    stopping_ = true;
    thread_.join();
    return counts_;
  }

  struct Call {
    std::unique_ptr<grpc::ClientContext> context = call_context();
    grpc::Status status;
    v1::Diagnosis diagnosis;
    v1::SceneOutline outline;
    std::shared_ptr<void> reader;
  };

 private:
  void begin() {
    ++under_way_;
    start_(client_, queue_, *new Call);
  }
  void run() {
    void* tag = nullptr;
    bool ok = false;
    while (under_way_ > 0 && queue_.Next(&tag, &ok)) {
      --under_way_;
      const std::unique_ptr<Call> call(static_cast<Call*>(tag));
      count(call->status);
      if (!stopping_) begin();
    }
    queue_.Shutdown();
    while (queue_.Next(&tag, &ok)) {
    }
  }
  void count(const grpc::Status& status) {
    if (status.ok()) {
      ++counts_.served;
    } else if (status.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED) {
      if (counts_.otherwise++ == 0) counts_.first_otherwise = status.error_message();
    } else if (detail_of(status).what().empty()) {
      ++counts_.refused_by_the_pool;
    } else {
      ++counts_.refused_with_detail;
    }
  }

  ServiceClient client_;
  std::function<void(const ServiceClient&, grpc::CompletionQueue&, Call&)> start_;
  grpc::CompletionQueue queue_;
  int under_way_ = 0;  ///< of the constructor's thread, then of thread_
  std::atomic<bool> stopping_{false};
  Counts counts_;
  std::thread thread_;
};

void diagnose(const ServiceClient& client, grpc::CompletionQueue& queue, Flood::Call& call) {
  v1::DiagnoseRequest request;
  request.set_probe(true);
  auto reader = client.rig->AsyncDiagnose(call.context.get(), request, &queue);
  reader->Finish(&call.diagnosis, &call.status, &call);
  call.reader = std::move(reader);
}

void explain(const ServiceClient& client, grpc::CompletionQueue& queue, Flood::Call& call) {
  v1::ExplainSceneRequest request;
  request.set_name("explore_rod");
  auto reader = client.scene->AsyncExplainScene(call.context.get(), request, &queue);
  reader->Finish(&call.outline, &call.status, &call);
  call.reader = std::move(reader);
}

TEST(Flood, OfSlowCallsKeepsNoOneFromStoppingAndClearing) {
  const RunningService service(config_with_scene("tap_1d"));
  service.press(2.0);
  // Both on separate connections, as many as one may have calls.
  std::vector<std::unique_ptr<Flood>> floods;
  floods.push_back(std::make_unique<Flood>(service.address(), 100, diagnose));
  for (int i = 0; i < 3; ++i) floods.push_back(std::make_unique<Flood>(service.address(), 100, explain));
  for (int round = 0; round < 20; ++round) {
    v1::StopResponse stopped;
    const grpc::Status stop = service.safety->Stop(call_context().get(), {}, &stopped);
    ASSERT_TRUE(stop.ok()) << "round " << round << ": " << stop.error_message();
    EXPECT_EQ(stopped.guard_state(), v1::GUARD_STATE_LATCHED);
    v1::ClearResponse cleared;
    const grpc::Status clear = service.safety->Clear(call_context().get(), {}, &cleared);
    ASSERT_TRUE(clear.ok()) << "round " << round << ": " << clear.error_message();
    EXPECT_EQ(cleared.cleared_fault(), v1::GUARD_FAULT_STOPPED);
  }
  int refused = 0;
  for (const auto& flood : floods) {
    const Flood::Counts counts = flood->stop();
    EXPECT_GT(counts.served, 0);
    EXPECT_EQ(counts.otherwise, 0) << counts.first_otherwise;
    refused += counts.refused_with_detail;
  }
  EXPECT_GT(refused, 0) << "the flood was none";
  EXPECT_TRUE(service.load("wall").ok()) << "over, and all as before";
}

TEST(Flood, RefusalsOfSlowCallsSayTheLimit) {
  const RunningService service;
  Flood flood(service.address(), 100, explain);
  v1::ExplainSceneRequest request;
  request.set_name("explore_rod");
  v1::ErrorDetail detail;
  for (int i = 0; i < 1000 && detail.limit().empty(); ++i) {
    v1::SceneOutline outline;
    detail = detail_of(service.scene->ExplainScene(call_context().get(), request, &outline));
  }
  flood.stop();
  EXPECT_EQ(detail.what(), "too many explanations of scenes at once");
  EXPECT_EQ(detail.limit(), "up to 4");
}

/// A daemon that is attacked over one of its transports, and what it takes of memory meanwhile.
class AttackedDaemon {
 public:
  explicit AttackedDaemon(bool over_unix_socket)
      : process_({"--listen", "127.0.0.1:0", "--scene", "tap_1d", "--unix", folder_.path("sock")}),
        tcp_(process_.await_address()),
        attacked_(over_unix_socket ? "unix:" + folder_.path("sock") : tcp_),
        client_(connect(tcp_)) {
    client_.state();
    before_mb_ = max_mb_ = resident_mb(process_.pid());
  }
  /// Attacks until it returns; stops by the service all the while.
  void attack(const std::function<void(const std::string& address)>& run) {
    std::atomic<bool> done{false};
    std::thread attacking([&] {
      run(attacked_);
      done = true;
    });
    int stops = 0;
    while (!done || stops == 0) {
      max_mb_ = std::max(max_mb_, resident_mb(process_.pid()));
      if (stops == 200) continue;  // the log is read at the end
      EXPECT_TRUE(ok(client_.stop()));
      ++stops;
    }
    attacking.join();
  }
  double grown_mb() const { return max_mb_ - before_mb_; }
  void expect_all_is_well_afterwards() {
    EXPECT_TRUE(ok(client_.clear()));
    const ServiceClient client(connect(attacked_));
    // The threads of calls that were cut off end soon after.
    grpc::Status load;
    EXPECT_TRUE(eventually([&] {
      load = client.load("wall");
      return load.error_code() != grpc::StatusCode::RESOURCE_EXHAUSTED;
    }));
    EXPECT_TRUE(ok(load));
    process_.end();
  }
  const std::string& log() const { return process_.errors(); }

 private:
  TemporaryFolder folder_;
  DaemonProcess process_;
  const std::string tcp_;
  const std::string attacked_;
  const ServiceClient client_;
  double before_mb_ = 0.0;
  double max_mb_ = 0.0;
};

/// A sanitizer keeps what is freed and puts space around each block.
constexpr double kMaxGrowthMb = kThreadSanitized ? std::numeric_limits<double>::infinity()
                                : kSanitized     ? 300.0
                                                 : 100.0;

struct Resets {
  const char* method;
  bool over_unix_socket;
  friend void PrintTo(const Resets& resets, std::ostream* out) {
    *out << resets.method << (resets.over_unix_socket ? " by the unix socket" : " by TCP");
  }
};
class FloodOfResets : public testing::TestWithParam<Resets> {};

// Twenty thousand calls that were opened and reset at once took half a gigabyte of locked memory, by one
// connection.
TEST_P(FloodOfResets, TakesABoundedMemoryAndStopsNoStop) {
  AttackedDaemon daemon(GetParam().over_unix_socket);
  daemon.attack([](const std::string& address) {
    for (int sent = 0; sent < 60'000;)
      sent += 1 + Http2Flood(address).open_and_reset(GetParam().method, 60'000);
  });
  RecordProperty("grown_mb", std::to_string(daemon.grown_mb()));
  EXPECT_LT(daemon.grown_mb(), kMaxGrowthMb);
  daemon.expect_all_is_well_afterwards();
  EXPECT_NE(daemon.log().find("it opens calls and gives them up at once"), std::string::npos) << daemon.log();
}

INSTANTIATE_TEST_SUITE_P(Methods, FloodOfResets,
                         testing::Values(Resets{"/hapticd.v1.TelemetryService/Subscribe", false},
                                         Resets{"/hapticd.v1.TelemetryService/Subscribe", true},
                                         Resets{"/hapticd.v1.RigService/GetRigState", false},
                                         Resets{"/hapticd.v1.SceneService/ListScenes", true},
                                         Resets{"/hapticd.v1.SafetyService/Stop", false}));

class FloodOfHeaders : public testing::TestWithParam<bool> {};

// Four headers without an end kept every stop waiting for half a minute.
TEST_P(FloodOfHeaders, IsClosedBeforeAnyoneHasToReadIt) {
  AttackedDaemon daemon(GetParam());
  std::atomic<long> largest{0};
  daemon.attack([&largest](const std::string& address) {
    std::vector<std::thread> threads;
    for (int i = 0; i < 10; ++i) {
      threads.emplace_back([&] {
        for (int n = 0; n < 20; ++n) {
          const long sent = Http2Flood(address).send_endless_header(12'000'000);
          long before = largest;
          while (sent > before && !largest.compare_exchange_weak(before, sent)) {
          }
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
  });
  EXPECT_LT(largest.load(), 12'000'000) << "it was closed while it was sent";
  EXPECT_LT(daemon.grown_mb(), kMaxGrowthMb);
  daemon.expect_all_is_well_afterwards();
  EXPECT_NE(daemon.log().find("a header is too long"), std::string::npos) << daemon.log();
}
INSTANTIATE_TEST_SUITE_P(Transports, FloodOfHeaders, testing::Bool());

TEST(Flood, OfUnfinishedRequestsTakesABoundedMemory) {
  AttackedDaemon daemon(true);
  daemon.attack([](const std::string& address) {
    std::vector<std::unique_ptr<Http2Flood>> held;
    for (int i = 0; i < 40; ++i) {
      held.push_back(std::make_unique<Http2Flood>(address));
      held.back()->open_unfinished("/hapticd.v1.SceneService/LoadScene", 90, 60'000);
    }
  });
  EXPECT_LT(daemon.grown_mb(), kMaxGrowthMb);
  daemon.expect_all_is_well_afterwards();
}

// Each held a thread: a renewal of a lease found none, and after 5 s its holder had lost it.
TEST(Flood, OfUnreadAnswersLeavesThreadsToOthers) {
  const TemporaryFolder folder;
  DaemonProcess daemon({"--listen", "127.0.0.1:0", "--scene", "tap_1d", "--unix", folder.path("sock")});
  const std::string address = daemon.await_address();
  const ServiceClient client(connect(address));
  const auto lease = v1::LeaseService::NewStub(client.channel);
  const v1::LeaseGrant grant = answer_of(*lease, &v1::LeaseService::Stub::AcquireLease);
  std::vector<std::unique_ptr<Http2Flood>> held;
  for (int i = 0; i < 3; ++i) {
    held.push_back(std::make_unique<Http2Flood>(address));
    held.back()->open_unread("/hapticd.v1.AccessService/GetAccess", 90);
    held.push_back(std::make_unique<Http2Flood>(address));
    held.back()->open_unread("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", 90,
                             "\x3a\x01*", false);
  }
  // The flood has come when its own identity is refused. While it comes, all threads may have one of its
  // calls to refuse.
  v1::Access me;
  const auto access = v1::AccessService::NewStub(client.channel);
  grpc::Status own;
  EXPECT_TRUE(eventually([&] {
    own = access->GetAccess(call_context().get(), {}, &me);
    return own.error_message().find("too many calls without an answer") != std::string::npos;
  })) << own.error_message();
  EXPECT_EQ(own.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);

  const auto renewal = call_context();
  renewal->AddMetadata("hapticd-lease", grant.token());
  v1::Lease renewed;
  const grpc::Status renews = lease->RenewLease(renewal.get(), {}, &renewed);
  EXPECT_TRUE(renews.ok()) << renews.error_message();
  v1::TurntableStatus table;
  const auto turntable = v1::TurntableService::NewStub(client.channel);
  const grpc::Status halt = turntable->StopTurntable(call_context().get(), {}, &table);
  EXPECT_EQ(halt.error_code(), grpc::StatusCode::FAILED_PRECONDITION)
      << "there is none, but it was asked: " << halt.error_message();
  // A console may call for others.
  const auto other = v1::RigService::NewStub(connect("unix:" + folder.path("sock")));
  grpc::Status reads;
  EXPECT_TRUE(eventually([&] {
    const auto on_behalf = call_context();
    on_behalf->AddMetadata("hapticd-on-behalf-of", "user:nobody");
    v1::RigState state;
    reads = other->GetRigState(on_behalf.get(), {}, &state);
    return reads.ok();
  })) << reads.error_message();
  daemon.end();
}

TEST(Flood, AProcessMayHaveAsManyConnectionsAsTheSystemAllows) {
  rlimit ours{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  rlimit few = ours;
  few.rlim_cur = 256;
  if (ours.rlim_max <= few.rlim_cur) GTEST_SKIP() << "there is nothing to raise";
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &few), 0);
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &ours), 0);
  process.await_address();
  rlimit theirs{};
  ASSERT_EQ(prlimit(process.pid(), RLIMIT_NOFILE, nullptr, &theirs), 0);
  EXPECT_EQ(theirs.rlim_cur, ours.rlim_max);
}

/// Open connections that say nothing, as a client leaves them that leaks channels.
class IdleConnections {
 public:
  IdleConnections(const std::string& address, int count) {
    const int port = std::stoi(address.substr(address.rfind(':') + 1));
    for (int i = 0; i < count; ++i) {
      descriptors_.push_back(connect_to_loopback(port));
      EXPECT_GE(descriptors_.back(), 0) << "this process may need more descriptors itself";
    }
  }
  ~IdleConnections() {
    for (const int descriptor : descriptors_) close(descriptor);
  }
  /// Waits until the service has closed one of them.
  bool one_is_refused() const {
    std::vector<pollfd> watched;
    for (const int descriptor : descriptors_) watched.push_back({descriptor, POLLRDHUP, 0});
    return poll(watched.data(), watched.size(), static_cast<int>(1000 * kTimeout.count())) > 0;
  }

 private:
  std::vector<int> descriptors_;
};

// Each took the time of one that speaks, which had to wait for all before it.
TEST(Flood, OfConnectionsThatSayNothingIsNotServed) {
  constexpr std::ptrdiff_t kSilent = 100;
  constexpr std::ptrdiff_t kOfOneClient = 10;
  DaemonProcess process({"--listen", "127.0.0.1:0"});
  const std::string address = process.await_address();
  const ServiceClient first(connect(address));
  first.state();
  const auto count = [&process] {
    const std::filesystem::directory_iterator files("/proc/" + std::to_string(process.pid()) + "/fd");
    return std::distance(begin(files), end(files));
  };
  const std::ptrdiff_t before = count();
  const IdleConnections silent(address, kSilent);
  const ServiceClient last(connect(address));
  last.state();  // it came after them
  EXPECT_LT(count() - before, kSilent + kOfOneClient) << "one descriptor each";
}

class FloodOfConnections : public testing::TestWithParam<int> {};

// A listener of gRPC's own that was once refused a descriptor never accepted again.
TEST_P(FloodOfConnections, ClosesThePortToNoOneAfterwards) {
  const int max_descriptors = GetParam();
  const int connections = max_descriptors + 76;
  rlimit ours{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &ours), 0);
  if (ours.rlim_max < static_cast<rlim_t>(connections) + 100) GTEST_SKIP() << "this process may open too few";
  const rlimit enough{ours.rlim_max, ours.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &enough), 0);
  DaemonProcess process({"--listen", "127.0.0.1:0", "--scene", "tap_1d"}, max_descriptors);
  const std::string address = process.await_address();
  const ServiceClient before(connect(address));
  before.state();
  for (int round = 0; round < 3; ++round) {
    const IdleConnections idle(address, connections);
    EXPECT_TRUE(idle.one_is_refused());
    // Those that were open are served, and files can still be opened: one that had calls goes last.
    before.state();
    EXPECT_TRUE(before.load("wall").ok());
    EXPECT_TRUE(ServiceClient(connect(address)).stop().ok()) << "whatever stands in line";
    EXPECT_TRUE(before.stop().ok());
  }
  v1::RigState state;
  const auto context = call_context();
  context->set_wait_for_ready(true);  // the last of those connections have yet to be seen to be closed
  EXPECT_TRUE(ok(ServiceClient(connect(address)).rig->GetRigState(context.get(), {}, &state)));
  process.end();
  EXPECT_NE(process.errors().find("a newer one of its client took its place"), std::string::npos)
      << process.errors();
  EXPECT_EQ(setrlimit(RLIMIT_NOFILE, &ours), 0);
}

INSTANTIATE_TEST_SUITE_P(Limits, FloodOfConnections, testing::Values(300, 1024));

}  // namespace
}  // namespace hapticd::test
