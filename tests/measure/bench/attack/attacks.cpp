#include "tests/measure/bench/attack/attacks.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <exception>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "client/cpp/client.h"
#include "tests/measure/bench/attack/rows.h"
#include "tests/measure/report/child_process.h"
#include "tests/support/http2_flood.h"

namespace hapticd::bench {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr std::chrono::seconds kPatience{30};
constexpr milliseconds kPause{1};
constexpr milliseconds kLook{20};

/// Runs so many threads that do one thing again and again; what fails is tried again.
void in_threads(int count, AttackState& state, const std::function<void()>& once) {
  std::vector<std::thread> threads;
  for (int i = 0; i < count; ++i) {
    threads.emplace_back([&] {
      while (!state.done) {
        try {
          once();
        } catch (const std::exception&) {
          std::this_thread::sleep_for(kPause);  // refused, or closed: again
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

void wait_for_end(const AttackState& state) {
  while (!state.done) std::this_thread::sleep_for(kLook);
}

void nothing(const Victim& /*victim*/, const std::string& /*transport*/, AttackState& state) {
  state.under_way = true;
  wait_for_end(state);
}

auto endless_headers(int connections) {
  return [connections](const Victim& victim, const std::string& transport, AttackState& state) {
    in_threads(connections, state, [&] {
      test::Http2Flood flood(victim.address(transport), victim.certificates());
      state.under_way = true;
      flood.send_endless_header(13'000'000);
      ++state.inputs;
    });
  };
}

void resets(const Victim& victim, const std::string& transport, AttackState& state) {
  in_threads(2, state, [&] {
    test::Http2Flood flood(victim.address(transport), victim.certificates());
    state.under_way = true;
    state.inputs += flood.open_and_reset("/hapticd.v1.TelemetryService/Subscribe", 120'000);
  });
}

void unfinished_requests(const Victim& victim, const std::string& transport, AttackState& state) {
  in_threads(8, state, [&] {
    test::Http2Flood flood(victim.address(transport), victim.certificates());
    state.inputs += flood.open_unfinished("/hapticd.v1.SceneService/LoadScene", 99, 60'000);
    state.under_way = true;
    while (!state.done && !flood.is_closed()) std::this_thread::sleep_for(kLook);
  });
}

/// Answers that stay unread, and streams of reflection without an end: each held one of the service's
/// threads.
void unread_answers(const Victim& victim, const std::string& transport, AttackState& state) {
  in_threads(4, state, [&] {
    test::Http2Flood calls(victim.address(transport), victim.certificates());
    state.inputs += calls.open_unread("/hapticd.v1.AccessService/GetAccess", 90);
    test::Http2Flood streams(victim.address(transport), victim.certificates());
    state.inputs += streams.open_unread("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", 90,
                                        "\x3a\x01*", false);
    state.under_way = true;
    while (!state.done && !calls.is_closed() && !streams.is_closed()) std::this_thread::sleep_for(kLook);
  });
}

/// Connections that say nothing; those that are closed are opened again.
auto idle_connections(int count) {
  return [count](const Victim& victim, const std::string& transport, AttackState& state) {
    sockaddr_storage peer{};
    socklen_t length = sizeof(sockaddr_in);
    const std::string address = victim.address(transport);
    if (transport == "unix") {
      auto& name = reinterpret_cast<sockaddr_un&>(peer);
      name.sun_family = AF_UNIX;
      std::strncpy(name.sun_path, address.c_str() + 5, sizeof name.sun_path - 1);
      length = sizeof name;
    } else {
      auto& name = reinterpret_cast<sockaddr_in&>(peer);
      name.sin_family = AF_INET;
      name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      name.sin_port = htons(static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    }
    std::vector<int> open(static_cast<std::size_t>(count), -1);
    while (!state.done) {
      for (int& descriptor : open) {
        if (state.done) break;
        char byte = 0;
        const bool is_open =
            descriptor >= 0 && (recv(descriptor, &byte, 1, MSG_DONTWAIT) > 0 || errno == EAGAIN);
        if (is_open) continue;
        if (descriptor >= 0) close(descriptor);
        descriptor = socket(peer.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
        connect(descriptor, reinterpret_cast<const sockaddr*>(&peer), length);
        ++state.inputs;
      }
      state.under_way = true;
      std::this_thread::sleep_for(kPause);
    }
    for (const int descriptor : open) {
      if (descriptor >= 0) close(descriptor);
    }
  };
}

void waiting_calls(const Victim& victim, const std::string& transport, AttackState& state) {
  client::Client client(victim.options(transport));
  client.load_scene({.name = "tap_1d"});
  in_threads(64, state, [&] {
    v1::SetTargetRequest request;
    request.set_stiffness_n_per_mm(0.4);
    request.set_at_time_ns(client.rig_state(client::Histograms::kWithout).time_ns() + 2'000'000'000);
    ++state.inputs;
    state.under_way = true;
    client.set_target(request);
  });
}

/// Uploads so many bytes of a recording that takes long to read, and returns the daemon's name of it.
std::string uploaded(client::Client& client, std::uint64_t bytes, const AttackState& state) {
  v1::RecordingDescription description;
  description.set_name("attack.csv");
  Rows rows(bytes, Rows::Length::kShort);
  client::RecordingUpload upload = client.upload_recording(description);
  for (std::string piece = rows.next_piece(); !piece.empty(); piece = rows.next_piece()) {
    if (state.done) return {};
    upload.send(std::move(piece));
    if (!upload.taken(kPatience)) throw std::runtime_error("the daemon does not take the recording");
  }
  upload.finish();
  while (!state.done) {
    if (const auto answer = upload.answer(kLook)) return answer->recording();
  }
  return {};
}

/// Uploads a recording that is read again and again, as each identification has to.
auto upload_being_parsed(double scale) {
  return [scale](const Victim& victim, const std::string& transport, AttackState& state) {
    client::Client client(victim.options(transport));
    v1::StartIdentificationRequest request;
    request.set_object("attack");
    request.set_recording(uploaded(client, static_cast<std::uint64_t>(500e6 * scale), state));
    request.mutable_contact();
    in_threads(1, state, [&] {
      ++state.inputs;
      state.under_way = true;
      client.start_identification(request);
    });
  };
}

void locked_store(const Victim& victim, const std::string& transport, AttackState& state) {
  const std::string script =
      "import sqlite3, sys, time\nd = sqlite3.connect(sys.argv[1])\nd.execute('BEGIN EXCLUSIVE')\n"
      "time.sleep(1000)\n";
  report::ChildProcess holder({.command = {"/usr/bin/python3", "-c", script, victim.store().string()}});
  in_threads(8, state, [&] {
    client::Client client(victim.options(transport));
    ++state.inputs;
    state.under_way = true;
    client.tag_stored_model(std::string(64, 'a'), "current");
  });
}

/// Stops a console with its connections open. It speaks to the daemon over the unix socket.
void stopped_console(const Victim& victim, const std::string& /*transport*/, AttackState& state) {
  const std::filesystem::path log = victim.folder() / "console.log";
  report::ChildProcess console({.command = {(program_folder() / "hapticd-console").string(), "--server",
                                            victim.address("unix"), "--listen", "127.0.0.1:0"},
                                .output = log});
  const auto until = Clock::now() + kPatience;
  for (std::string text; text.find("listens on") == std::string::npos;) {
    if (Clock::now() > until) throw std::runtime_error("the console does not start: " + text);
    std::this_thread::sleep_for(kLook);
    std::ostringstream read;
    read << std::ifstream(log).rdbuf();
    text = read.str();
  }
  console.signal(SIGSTOP);
  ++state.inputs;
  state.under_way = true;
  wait_for_end(state);
  console.signal(SIGCONT);
}

}  // namespace

std::vector<Attack> attacks(double scale) {
  return {{"none", nothing},
          {"endless_headers_4", endless_headers(4)},
          {"endless_headers_10", endless_headers(10)},
          {"resets", resets},
          {"unfinished_requests", unfinished_requests},
          {"unread_answers", unread_answers},
          {"idle_connections_4000", idle_connections(4000)},
          {"full_descriptors", idle_connections(400), 256},
          {"waiting_calls_64", waiting_calls},
          {"upload_500_mb", upload_being_parsed(scale)},
          {"locked_store", locked_store},
          {"stopped_console", stopped_console}};
}

}  // namespace hapticd::bench
