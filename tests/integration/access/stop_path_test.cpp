// Stops that do not pass gRPC, of a daemon: by every transport, by the library, and from a program.

#include <gtest/gtest.h>
#include <openssl/ssl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <deque>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "client/cpp/stop/stop.h"
#include "client/cpp/stop/stop_port.h"
#include "server/access/local_user.h"
#include "tests/integration/robustness/raw_call.h"
#include "tests/integration/running_service.h"
#include "tests/support/eventually.h"
#include "tests/support/http2_flood.h"
#include "tests/support/lab.h"
#include "tests/support/system/loopback.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

using client::Error;

/// A daemon that listens by every transport.
struct Everywhere {
  explicit Everywhere(const server::AccessConfig& access = {}) : service(config(access)) {}
  server::DaemonConfig config(const server::AccessConfig& access) const {
    server::DaemonConfig config = quiet_config();
    config.access = access;
    config.access.audit_file = folder.path("audit.jsonl");
    config.unix_socket = folder.path("sock");
    config.listen_tls = server::ListenAddress{"127.0.0.1", 0};
    config.certificates = lab.server();
    return config;
  }
  std::vector<client::ClientOptions> options() const {
    const std::string tls = "tls:127.0.0.1:" + std::to_string(service.daemon->tls_port());
    return {{.address = service.address(), .timeout = kTimeout},
            {.address = "unix:" + folder.path("sock"), .timeout = kTimeout},
            {.address = tls, .timeout = kTimeout, .certificates = lab.client("screen")}};
  }
  void expect_latched_and_clear() const {
    service.await(is_latched);
    // Again where a stop of a flood was still on its way.
    service.await([&](const v1::RigState& s) {
      if (s.guard_state() != v1::GUARD_STATE_LATCHED) return true;
      service.clear();
      return false;
    });
  }

  TemporaryFolder folder;
  Lab lab;
  RunningService service;
};

TEST(StopPath, StopsByEveryTransportWithoutTheService) {
  const Everywhere daemon;
  for (const client::ClientOptions& options : daemon.options()) {
    const std::uint64_t before = daemon.service.state().tick();
    const std::uint64_t tick = client::stop_by_stop_port(options.address, options.certificates, kTimeout);
    EXPECT_GE(tick, before) << options.address;
    daemon.expect_latched_and_clear();
  }
}

TEST(StopPath, TheLibraryUsesBothPathsAndSaysWhichCameFirst) {
  const Everywhere daemon;
  for (const client::ClientOptions& options : daemon.options()) {
    const client::StopOutcome outcome = client::stop(options, "enough");
    EXPECT_EQ(outcome.answer.guard_state(), v1::GUARD_STATE_LATCHED) << options.address;
    EXPECT_EQ(outcome.answer.guard_fault(), v1::GUARD_FAULT_STOPPED);
    EXPECT_GT(outcome.after.count(), 0);
    daemon.expect_latched_and_clear();
    const client::StopOutcome again = client::Client(options).stop("enough");
    EXPECT_EQ(again.answer.guard_state(), v1::GUARD_STATE_LATCHED);
    daemon.expect_latched_and_clear();
  }
}

TEST(StopPath, IsInTheAuditLogByItsPath) {
  std::string text;
  {
    const Everywhere daemon;
    for (const client::ClientOptions& options : daemon.options()) {
      client::stop_by_stop_port(options.address, options.certificates, kTimeout);
    }
    eventually([&] {
      text = file_text(daemon.folder.path("audit.jsonl"));
      return std::count(text.begin(), text.end(), '\n') >= 3;
    });
  }
  for (const char* part : {"by the stop port\"", "by the datagram socket",
                           "by the stop port with certificates", "spiffe://optics/hapticd/observer/screen",
                           "SafetyService/Stop", R"("role":"observer")", R"("role":"maintainer")"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
  }
  EXPECT_EQ(text.find(R"("role":"")"), std::string::npos) << text;
}

// A client that stops without end fills no log and no audit log, nor hides who else stopped.
TEST(StopPath, OfTheServiceIsWrittenDownSoManyTimesASecond) {
  constexpr int kStops = 400;
  constexpr int kMaxPerS = 20;
  std::string text;
  const auto began = std::chrono::steady_clock::now();
  std::chrono::duration<double> took{};
  {
    const Everywhere daemon;
    for (int i = 0; i < kStops; ++i) {
      const RawAnswer answer =
          raw_call(daemon.service.channel, "/hapticd.v1.SafetyService/Stop", "\xff\xff\xff\xff");
      ASSERT_TRUE(answer.status.ok()) << answer.status.error_message();
    }
    v1::StopRequest mine;
    mine.set_reason("the finger hurts");
    ASSERT_TRUE(daemon.service.stop(mine).ok());
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    raw_call(daemon.service.channel, "/hapticd.v1.SafetyService/Stop", "\xff\xff\xff\xff");
    took = std::chrono::steady_clock::now() - began;
    eventually([&] {
      text = file_text(daemon.folder.path("audit.jsonl"));
      return text.find("more before") != std::string::npos;
    });
  }
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), kMaxPerS * (2.0 + took.count()));
  EXPECT_NE(text.find("the finger hurts"), std::string::npos) << text;
  EXPECT_NE(text.find("more before"), std::string::npos) << text;
}

TEST(StopPath, ComesWhileEveryOtherPathIsFlooded) {
  const Everywhere daemon;
  std::atomic<bool> done{false};
  std::vector<std::thread> attackers;
  const auto keep_attacking = [&done](auto attack) {
    while (!done) {
      try {
        attack();
      } catch (const std::exception&) {
        std::this_thread::yield();  // no place: again
      }
    }
  };
  for (const client::ClientOptions& options : daemon.options()) {
    attackers.emplace_back([&, options] {
      keep_attacking(
          [&] { Http2Flood(options.address, options.certificates).send_endless_header(10'000'000); });
    });
    attackers.emplace_back([&, options] {
      keep_attacking([&] {
        Http2Flood(options.address, options.certificates)
            .open_and_reset("/hapticd.v1.SafetyService/Stop", 50'000);
      });
    });
  }
  for (int i = 0; i < 50; ++i) {
    for (const client::ClientOptions& options : daemon.options()) {
      EXPECT_NO_THROW(client::stop_by_stop_port(options.address, options.certificates, kTimeout));
    }
  }
  done = true;
  for (std::thread& attacker : attackers) attacker.join();
  daemon.expect_latched_and_clear();
}

/// The first bytes of an encrypted connection: the other side has most of the work with them.
std::string hello() {
  SSL_CTX* context = SSL_CTX_new(TLS_client_method());
  SSL* tls = SSL_new(context);
  SSL_set_bio(tls, BIO_new(BIO_s_mem()), BIO_new(BIO_s_mem()));
  SSL_connect(tls);  // waits for an answer
  std::string bytes(4096, '\0');
  const int size = BIO_read(SSL_get_wbio(tls), bytes.data(), static_cast<int>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(std::max(size, 0)));
  SSL_free(tls);
  SSL_CTX_free(context);
  return bytes;
}

TEST(StopPath, ComesWhileHandshakesThatNeverEndFloodItsPort) {
  const Everywhere daemon;
  const int port = daemon.service.daemon->tls_port() + 1;
  const std::string first = hello();
  ASSERT_FALSE(first.empty());
  std::atomic<bool> done{false};
  std::thread attacker([&] {
    constexpr std::size_t kHeld = 200;
    std::deque<int> held;
    while (!done) {
      held.push_back(connect_to_loopback(port));
      send(held.back(), first.data(), first.size(), MSG_NOSIGNAL);
      std::this_thread::sleep_for(
          std::chrono::milliseconds(1));  // some hundred a second, also on a slow machine
      if (held.size() <= kHeld) continue;
      close(held.front());
      held.pop_front();
    }
    for (const int descriptor : held) close(descriptor);
  });
  const client::ClientOptions options = daemon.options()[2];
  for (int i = 0; i < 50; ++i) {
    EXPECT_NO_THROW(client::stop_by_stop_port(options.address, options.certificates, kTimeout)) << i;
  }
  done = true;
  attacker.join();
}

TEST(StopPath, RefusesTheDeniedByEveryTransport) {
  server::AccessConfig access;
  access.denied["user:" + server::user_of_id(getuid()).name] = "left the lab";
  access.denied["spiffe://optics/hapticd/observer/screen"] = "sold";
  const Everywhere daemon(access);
  for (const client::ClientOptions& options : daemon.options()) {
    const Error error =
        thrown_by<Error>([&] { client::stop_by_stop_port(options.address, options.certificates, kTimeout); });
    EXPECT_EQ(error.kind(), client::ErrorKind::kRefused) << error.what();
    EXPECT_THROW(client::stop(options, "denied"), Error);
  }
}

TEST(StopPath, NeedsACertificateOfTheLab) {
  const Everywhere daemon;
  const Lab foreign;
  const std::string address = daemon.options()[2].address;
  EXPECT_THROW(client::stop_by_stop_port(address, foreign.client("anna"), kTimeout), Error);
  EXPECT_THROW(client::stop_by_stop_port(address.substr(4), "", kTimeout), Error) << "nothing plain";
  EXPECT_EQ(daemon.service.state().guard_state() == v1::GUARD_STATE_LATCHED, false);
}

TEST(StopPath, ReadsItsCertificatesAgainWhenTheyHaveChanged) {
  const Everywhere daemon;
  const Lab foreign;
  const std::string address = daemon.options()[2].address;
  const std::string own = daemon.folder.path("own");
  constexpr auto kOver = std::filesystem::copy_options::overwrite_existing;
  std::filesystem::copy(daemon.lab.client("screen"), own);
  EXPECT_NO_THROW(client::stop_by_stop_port(address, own, kTimeout));
  for (const auto& file : std::filesystem::directory_iterator(foreign.client("anna")))
    std::filesystem::copy_file(file, own + "/" + file.path().filename().string(), kOver);
  EXPECT_THROW(client::stop_by_stop_port(address, own, kTimeout), Error);
}

TEST(StopPath, SaysWhereNoDaemonIs) {
  const Error error = thrown_by<Error>(
      [&] { client::stop({.address = "127.0.0.1:1", .timeout = std::chrono::seconds(2)}, ""); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kUnreachable);
  EXPECT_EQ(error.detail().where(), "127.0.0.1:2");
}

// Certificates of another lab under the same authority: its name is in the path.
TEST(Labs, ThatAreNotTheDaemonsHaveNoRole) {
  const Everywhere daemon([] {
    server::AccessConfig access;
    access.lab = "acoustics";
    return access;
  }());
  client::Client screen(daemon.options()[2]);
  const v1::Access access = screen.access();
  EXPECT_EQ(access.role(), v1::ROLE_NONE);
  EXPECT_EQ(access.role_source(), "certificate of the lab optics, not of acoustics");
  EXPECT_NO_THROW(screen.stop("all who are identified may"));
}

TEST(Denied, AreDisconnectedAfterOneAnswer) {
  server::AccessConfig access;
  access.denied["user:" + server::user_of_id(getuid()).name] = "left the lab";
  const Everywhere daemon(access);
  const ServiceClient denied(connect("unix:" + daemon.folder.path("sock")));
  v1::RigState state;
  EXPECT_EQ(denied.rig->GetRigState(call_context().get(), {}, &state).error_code(),
            grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_TRUE(
      denied.channel->WaitForStateChange(GRPC_CHANNEL_READY, std::chrono::system_clock::now() + kTimeout));
}

TEST(Watchers, OfOneClientKeepNoOtherOut) {
  const Everywhere daemon;
  client::Client anyone(daemon.options()[0]);
  v1::EventBatch batch;
  std::vector<client::EventStream> held;
  for (int i = 0; i < 8; ++i) {
    held.push_back(anyone.watch_events({}));
    ASSERT_EQ(held.back().next(batch, kTimeout), client::EventStream::Event::kMessage) << i;
  }
  const Error error = thrown_by<Error>([&] {
    client::EventStream refused = anyone.watch_events({});
    refused.next(batch, kTimeout);
  });
  EXPECT_EQ(error.detail().reason(), v1::ERROR_REASON_TOO_MANY);
  EXPECT_EQ(error.detail().limit(), "up to 16, and 8 of one client");
  client::Client other(daemon.options()[2]);
  client::EventStream served = other.watch_events({});
  EXPECT_EQ(served.next(batch, kTimeout), client::EventStream::Event::kMessage);
}

}  // namespace
}  // namespace hapticd::test
