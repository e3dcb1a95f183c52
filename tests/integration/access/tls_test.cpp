// Connections with certificates, made by the script that a lab uses.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "client/cpp/client.h"
#include "server/diagnosis/certificate_findings.h"
#include "tests/integration/running_service.h"
#include "tests/support/eventually.h"
#include "tests/support/lab.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/value_of.h"

namespace hapticd::test {
namespace {

using client::Client;
using client::Error;

std::string tls_address(const RunningService& service, const std::string& host = "127.0.0.1") {
  return "tls:" + host + ":" + std::to_string(service.daemon->tls_port());
}

Client client_of(const RunningService& service, const std::string& certificates,
                 bool acquires_lease = false) {
  return Client({.address = tls_address(service),
                 .timeout = kTimeout,
                 .certificates = certificates,
                 .acquires_lease = acquires_lease});
}

/// The error of a connection that does not come about.
v1::ErrorDetail refused_connection(const RunningService& service, const std::string& certificates,
                                   const std::string& host = "127.0.0.1") {
  try {
    Client({.address = tls_address(service, host), .timeout = kTimeout, .certificates = certificates});
  } catch (const Error& error) {
    EXPECT_EQ(error.kind(), client::ErrorKind::kUnreachable) << error.what();
    return error.detail();
  }
  ADD_FAILURE() << "it connects";
  return {};
}

TEST(Certificates, ShowWhoAClientIs) {
  const Lab lab;
  const RunningService service(config_with_certificates(lab.server()));
  const v1::Access anna = client_of(service, lab.client("anna")).access();
  EXPECT_EQ(anna.identity(), "spiffe://optics/hapticd/operator/anna");
  EXPECT_EQ(anna.role(), v1::ROLE_OPERATOR);
  EXPECT_EQ(anna.role_source(), "certificate");
  EXPECT_EQ(anna.lease_rule(), v1::LEASE_RULE_REQUIRED);
  Client screen = client_of(service, lab.client("screen"));
  EXPECT_EQ(screen.access().role(), v1::ROLE_OBSERVER);
  EXPECT_NO_THROW(screen.stop("the screen may stop"));
  const Error error = thrown_by<Error>([&] { screen.clear(); });
  EXPECT_EQ(error.detail().reason(), v1::ERROR_REASON_NOT_PERMITTED);
  EXPECT_NE(error.detail().value().find("observer/screen"), std::string::npos);
}

TEST(Certificates, CommandsFromElsewhereGoUnderALease) {
  const Lab lab;
  const RunningService service(config_with_certificates(lab.server()));
  ASSERT_TRUE(service.load("tap_1d").ok());
  v1::SetTargetRequest request;
  request.set_stiffness_n_per_mm(0.3);
  Client anna = client_of(service, lab.client("anna"));
  const Error error = thrown_by<Error>([&] { anna.set_target(request); });
  EXPECT_EQ(error.detail().reason(), v1::ERROR_REASON_LEASE_REQUIRED);
  {
    Client automatic = client_of(service, lab.client("anna"), true);
    EXPECT_NO_THROW(automatic.set_target(request));
    EXPECT_EQ(anna.lease().lease().holder(), "spiffe://optics/hapticd/operator/anna");
    Client otto = client_of(service, lab.client("otto"), true);
    const Error held = thrown_by<Error>([&] { otto.set_target(request); });
    EXPECT_EQ(held.detail().reason(), v1::ERROR_REASON_LEASE_HELD);
    EXPECT_NE(held.detail().what().find("operator/anna"), std::string::npos);
  }
  EXPECT_FALSE(anna.lease().has_lease()) << "given back with the client";
}

TEST(Certificates, NothingPlainIsServedThere) {
  const Lab lab;
  const RunningService service(config_with_certificates(lab.server()));
  const ServiceClient plain(connect("127.0.0.1:" + std::to_string(service.daemon->tls_port())));
  v1::RigState state;
  EXPECT_EQ(plain.rig->GetRigState(call_context(std::chrono::seconds(5)).get(), {}, &state).error_code(),
            grpc::StatusCode::UNAVAILABLE);
}

TEST(Certificates, EachMistakeHasItsError) {
  const Lab lab;
  const Lab foreign;
  const RunningService service(config_with_certificates(lab.server()));
  EXPECT_EQ(refused_connection(service, foreign.client("anna")).what(),
            "the daemon's certificate is not from your lab's authority");
  lab.make("--client operator/late --days -1");
  EXPECT_EQ(refused_connection(service, lab.client("late")).what(), "your certificate has expired");
  // Certificates of another authority, but knowing this one.
  const TemporaryFolder mixed;
  std::filesystem::copy(foreign.client("anna") + "/client.crt", mixed.path("client.crt"));
  std::filesystem::copy(foreign.client("anna") + "/client.key", mixed.path("client.key"));
  std::filesystem::copy(lab.client("anna") + "/authority.crt", mixed.path("authority.crt"));
  EXPECT_EQ(refused_connection(service, mixed.path()).what(), "the daemon does not accept your certificate");
  lab.make("--server elsewhere,10.1.2.3,2001:db8::1");
  const RunningService elsewhere(config_with_certificates(lab.server("elsewhere")));
  const v1::ErrorDetail wrong_name = refused_connection(elsewhere, lab.client("anna"));
  EXPECT_EQ(wrong_name.what(), "the daemon's certificate is for another name");
  EXPECT_NE(wrong_name.value().find("it is for elsewhere, address 10.1.2.3, address 2001:db8::1"),
            std::string::npos)
      << wrong_name.value();
  const Error error =
      thrown_by<Error>([&] { Client({.address = tls_address(service), .certificates = "/nowhere"}); });
  EXPECT_EQ(error.kind(), client::ErrorKind::kBadAddress);
  EXPECT_EQ(error.detail().where(), "/nowhere/client.crt");
}

TEST(Certificates, ADaemonDoesNotStartWithWrongOnes) {
  const Lab lab;
  const Lab other;
  const auto problem_of = [](const std::string& folder) {
    server::StartFailure failure;
    EXPECT_EQ(server::Daemon::start(config_with_certificates(folder), failure), nullptr);
    return failure.error;
  };
  EXPECT_EQ(problem_of("/nowhere").where, "/nowhere/server.crt");
  const TemporaryFolder mixed;
  for (const char* file : {"server.crt", "authority.crt"}) {
    std::filesystem::copy(lab.server() + "/" + file, mixed.path(file));
  }
  std::filesystem::copy(other.server() + "/server.key", mixed.path("server.key"));
  EXPECT_EQ(problem_of(mixed.path()).what, "the key does not belong to the certificate");
  std::filesystem::remove(mixed.path("server.key"));
  ASSERT_EQ(mkfifo(mixed.path("server.key").c_str(), 0600), 0);  // without a writer
  EXPECT_EQ(problem_of(mixed.path()).value, "it is a pipe");
  lab.make("--server localhost --days -1");
  const hal::Error expired = problem_of(lab.server());
  EXPECT_EQ(expired.what, "the certificate is not valid");
  EXPECT_EQ(expired.value, "certificate has expired");
}

TEST(Certificates, AreReplacedUnderStreamsThatGoOn) {
  const Lab lab;
  const Lab next;
  const TemporaryFolder place;
  const std::string link = place.path("certificates");
  std::filesystem::create_directory_symlink(lab.server(), link);
  const RunningService service(config_with_certificates(link));
  constexpr int kStreams = 8;
  std::atomic<bool> enough{false};
  std::atomic<int> lost{0};
  std::atomic<std::uint64_t> after{0};
  std::atomic<bool> replaced{false};
  std::atomic<int> reading{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < kStreams; ++i) {
    readers.emplace_back([&] {
      try {
        Client reader = client_of(service, lab.client("screen"));
        client::TelemetryStream stream = reader.subscribe({});
        v1::TelemetryBatch batch;
        bool began = false;
        while (!enough) {
          const auto event = stream.next(batch, std::chrono::milliseconds(50));
          if (event == client::TelemetryStream::Event::kEnded) ++lost;
          if (event == client::TelemetryStream::Event::kEnded) return;
          if (event == client::TelemetryStream::Event::kMessage && !std::exchange(began, true)) ++reading;
          if (event == client::TelemetryStream::Event::kMessage && replaced) ++after;
        }
      } catch (const Error& error) {
        ADD_FAILURE() << error.what();
        ++lost;
      }
    });
  }
  EXPECT_TRUE(eventually([&] { return reading >= kStreams || lost > 0; }));
  std::filesystem::create_directory_symlink(next.server(), link + ".next");
  std::filesystem::rename(link + ".next", link);
  // Another authority altogether: once its clients are known, the files were read.
  EXPECT_TRUE(eventually([&] {
    try {
      replaced = client_of(service, next.client("anna")).access().role() == v1::ROLE_OPERATOR;
    } catch (const Error&) {
      return false;
    }
    return replaced.load();
  })) << "the new certificates were not read";
  EXPECT_TRUE(eventually([&] { return after >= 10 * kStreams || lost > 0; }));
  EXPECT_EQ(lost.load(), 0);
  EXPECT_GE(after.load(), 10U * kStreams);
  enough = true;
  for (std::thread& reader : readers) reader.join();
}

TEST(Certificates, TheDoctorWarnsThirtyDaysBeforeTheirEnd) {
  const Lab lab("--server localhost --days 60");
  using server::FindingSeverity;
  const auto severity_in = [&](int days) {
    const auto findings = server::examine_certificates(
        lab.server(), std::chrono::system_clock::now() + std::chrono::hours(24 * days));
    return findings.at(0).severity;
  };
  EXPECT_EQ(severity_in(0), FindingSeverity::kGood);
  EXPECT_EQ(severity_in(29), FindingSeverity::kGood);
  EXPECT_EQ(severity_in(31), FindingSeverity::kWarning);
  EXPECT_EQ(severity_in(61), FindingSeverity::kProblem);
  EXPECT_TRUE(server::examine_certificates("", std::chrono::system_clock::now()).empty());
}

}  // namespace
}  // namespace hapticd::test
