#include "client/cli/identify/identify_follow.h"

#include <fmt/core.h>

#include <optional>
#include <thread>

#include "client/cli/identify/identify_view.h"

namespace hapticd::cli {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kIdle{50};

/// True if the connection failed, not the request. A daemon that ends says so with these codes.
bool is_loss(const client::Error& error) {
  return error.kind() == client::ErrorKind::kUnreachable || error.kind() == client::ErrorKind::kTimedOut ||
         error.code() == "UNAVAILABLE" || error.code() == "CANCELLED";
}

client::Error silent(const std::string& address) {
  v1::ErrorDetail detail;
  detail.set_what("the daemon says nothing about the identification any more");
  detail.set_where(address);
  detail.set_remedy("look at the daemon's log");
  return {client::ErrorKind::kTimedOut, "", detail};
}

class Follower {
 public:
  Follower(client::Client& client, std::string identification, const IdentifyFollow& follow)
      : client_(client), identification_(std::move(identification)), follow_(follow) {}

  IdentifyEnd run() {
    stream_.emplace(client_.watch_identification(identification_));
    while (true) {
      if (follow_.leave && follow_.leave()) return IdentifyEnd::kLeft;
      if (stream_) {
        read();
        if (over_) return IdentifyEnd::kOver;
      } else {
        connect_again();
      }
      if (follow_.on_idle) follow_.on_idle(notice());
    }
  }

 private:
  void read() {
    try {
      v1::IdentificationProgress progress;
      switch (stream_->next(progress, kIdle)) {
        case client::IdentificationStream::Event::kMessage:
          last_word_ = Clock::now();
          lost_ = false;
          // Whichever it was that ran: it is this one from now on.
          if (!progress.identification().empty()) identification_ = progress.identification();
          over_ = is_over(progress);
          if (follow_.on_progress) follow_.on_progress(progress);
          return;
        case client::IdentificationStream::Event::kEnded:
          // In the middle of it: a daemon that ends in good order.
          return lose(silent(client_.address()));
        case client::IdentificationStream::Event::kNothing:
          if (Clock::now() - last_word_ > follow_.silence) lose(silent(client_.address()));
          return;
      }
    } catch (const client::Error& error) {
      if (!is_loss(error)) throw;
      lose(error);
    }
  }

  void connect_again() {
    std::this_thread::sleep_for(std::min(kIdle, follow_.pause));
    if (Clock::now() < next_attempt_) return;
    try {
      client_ = follow_.connect();
      stream_.emplace(client_.watch_identification(identification_));
    } catch (const client::Error& error) {
      if (!is_loss(error)) throw;
      lose(error);
    }
    last_word_ = Clock::now();
  }

  void lose(const client::Error& why) {
    stream_.reset();
    const auto now = Clock::now();
    if (!lost_) lost_since_ = now;
    lost_ = true;
    if (now - lost_since_ > follow_.timeout) throw client::Error(why);
    next_attempt_ = now + follow_.pause;
  }

  std::string notice() const {
    if (!lost_) return {};
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - lost_since_).count();
    return fmt::format("connection lost, trying again ({} s); the identification goes on without it",
                       seconds);
  }

  client::Client& client_;
  std::string identification_;
  const IdentifyFollow& follow_;
  std::optional<client::IdentificationStream> stream_;
  bool over_ = false;
  bool lost_ = false;
  Clock::time_point last_word_ = Clock::now();
  Clock::time_point lost_since_{};
  Clock::time_point next_attempt_{};
};

}  // namespace

IdentifyEnd follow_identification(client::Client& client, std::string identification,
                                  const IdentifyFollow& follow) {
  return Follower(client, std::move(identification), follow).run();
}

}  // namespace hapticd::cli
