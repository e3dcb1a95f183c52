#include "tests/emulators/modbus/emulated_drive.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "tests/emulators/modbus/drive_registers.h"
#include "tests/emulators/modbus/wire.h"
#include "tests/support/system/loopback.h"

namespace hapticd::test {

namespace {

constexpr std::size_t kHeader = 7;  // transaction, protocol, length, unit
constexpr int kLookMs = 5;

[[noreturn]] void fail(const char* what) {
  throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

std::unique_ptr<DriveRegisters> registers_of(EmulatedDrive::Make make) {
  if (make == EmulatedDrive::Make::kOrientalAz) return std::make_unique<AzDriveRegisters>();
  return std::make_unique<PlainDriveRegisters>();
}

}  // namespace

struct EmulatedDrive::State {
  using Clock = std::chrono::steady_clock;

  struct Connection {
    int fd = -1;
    Bytes received;
    Clock::time_point last{};
  };

  Options options;
  int listener = -1;
  int bound_port = 0;
  int master = -1;  ///< our end of the pty pair
  int slave = -1;   ///< kept open, so that a master may come and go
  std::string serial_path;
  std::vector<Connection> connections;
  Connection serial;

  mutable std::mutex mutex;
  std::unique_ptr<DriveRegisters> registers;
  EmulatedMotor motor;
  Clock::time_point motor_time = Clock::now();
  DriveFaults faults;
  bool restarting = false;

  std::atomic<bool> leave{false};
  std::atomic<std::uint64_t> requests{0};
  std::atomic<int> connected{0};
  std::thread thread;

  void advance() {
    const auto now = Clock::now();
    motor.advance(std::chrono::duration<double>(now - motor_time).count());
    motor_time = now;
  }

  void listen_on_tcp() {
    listener = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (listener < 0) fail("socket");
    const int on = 1;
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    sockaddr_in address = test::loopback(bound_port != 0 ? bound_port : options.tcp_port);
    if (bind(listener, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) fail("bind");
    if (::listen(listener, 8) != 0) fail("listen");
    socklen_t length = sizeof address;
    getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length);
    bound_port = ntohs(address.sin_port);
  }

  void open_pty() {
    char path[256] = {};
    if (openpty(&master, &slave, path, nullptr, nullptr) != 0) fail("openpty");
    termios settings{};
    tcgetattr(slave, &settings);
    cfmakeraw(&settings);
    tcsetattr(slave, TCSANOW, &settings);
    fcntl(master, F_SETFL, O_NONBLOCK);
    fcntl(master, F_SETFD, FD_CLOEXEC);
    fcntl(slave, F_SETFD, FD_CLOEXEC);
    serial_path = path;
    serial.fd = master;
  }

  void hang_up_all() {
    for (Connection& one : connections) close(one.fd);
    connections.clear();
    connected = 0;
  }

  void send(int fd, const Bytes& bytes) {
    std::size_t sent = 0;
    while (sent < bytes.size()) {
      // A pty knows no MSG_NOSIGNAL; a socket that is gone must not end the process.
      const ssize_t count = fd == master ? write(fd, bytes.data() + sent, bytes.size() - sent)
                                         : ::send(fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count <= 0) return;
      sent += static_cast<std::size_t>(count);
    }
  }

  /// The answer's function and data; empty for none.
  Bytes work(const Bytes& request, const DriveFaults& now) {
    ++requests;
    const bool writes =
        !request.empty() && (request[0] == 5 || request[0] == 6 || request[0] == 15 || request[0] == 16);
    if (now.exception != 0) return refusal(request, now.exception);
    if (writes && now.exception_on_write != 0) return refusal(request, now.exception_on_write);
    const std::lock_guard lock(mutex);
    advance();
    return answer(request, *registers, motor, {now.wrong_word_order, now.nan});
  }

  void pause(int milliseconds) {
    for (int waited = 0; waited < milliseconds && !leave; waited += 2) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  int take_delay_once_ms() {
    const std::lock_guard lock(mutex);
    return std::exchange(faults.delay_once_ms, 0);
  }

  void spoil(Bytes& frame, const DriveFaults& now) {
    if (now.garbage) {
      for (std::size_t i = 0; i < frame.size(); ++i) frame[i] = static_cast<std::uint8_t>(0xA5U ^ (i * 37U));
    }
    if (now.truncated) frame.resize(frame.size() / 2);
  }

  /// False if the connection is to be closed.
  bool serve_tcp(Connection& one, const DriveFaults& now) {
    while (one.received.size() >= kHeader) {
      const std::size_t length = one.received[4] * 256U + one.received[5];
      if (one.received[2] != 0 || one.received[3] != 0 || length < 2 || length > 254) return false;
      if (one.received.size() < 6 + length) return true;
      const Bytes request(one.received.begin() + kHeader,
                          one.received.begin() + static_cast<std::ptrdiff_t>(6 + length));
      Bytes frame(one.received.begin(), one.received.begin() + kHeader);
      one.received.erase(one.received.begin(),
                         one.received.begin() + static_cast<std::ptrdiff_t>(6 + length));
      if (now.hang_up) return false;
      const Bytes reply = work(request, now);
      if (now.silent) continue;
      pause(now.delay_ms + take_delay_once_ms());
      if (now.wrong_check) frame[1] = static_cast<std::uint8_t>(frame[1] + 7);
      if (now.wrong_unit) frame[6] = static_cast<std::uint8_t>(frame[6] + 1);
      frame[4] = static_cast<std::uint8_t>((reply.size() + 1) / 256);
      frame[5] = static_cast<std::uint8_t>((reply.size() + 1) % 256);
      frame.insert(frame.end(), reply.begin(), reply.end());
      spoil(frame, now);
      send(one.fd, frame);
    }
    return true;
  }

  void serve_serial(const DriveFaults& now) {
    Bytes& received = serial.received;
    for (;;) {
      const auto length = serial_request_length(received);
      if (!length || received.size() < *length) return;
      Bytes request(received.begin(), received.begin() + static_cast<std::ptrdiff_t>(*length - 2));
      const unsigned check = received[*length - 2] + received[*length - 1] * 256U;
      if (crc16(request) != check) {
        received.clear();  // where the next one begins, silence will show
        return;
      }
      received.erase(received.begin(), received.begin() + static_cast<std::ptrdiff_t>(*length));
      if (request[0] != options.unit) continue;  // another's
      const Bytes reply = work(Bytes(request.begin() + 1, request.end()), now);
      if (now.silent || now.hang_up) continue;
      pause(now.delay_ms + take_delay_once_ms());
      Bytes frame{static_cast<std::uint8_t>(options.unit + (now.wrong_unit ? 1 : 0))};
      frame.insert(frame.end(), reply.begin(), reply.end());
      const std::uint16_t crc = static_cast<std::uint16_t>(crc16(frame) + (now.wrong_check ? 1 : 0));
      frame.push_back(static_cast<std::uint8_t>(crc % 256U));
      frame.push_back(static_cast<std::uint8_t>(crc / 256U));
      spoil(frame, now);
      send(serial.fd, frame);
    }
  }

  /// False at the end of the stream.
  static bool receive(Connection& one) {
    std::uint8_t buffer[512];
    const ssize_t count = read(one.fd, buffer, sizeof buffer);
    if (count > 0) one.received.insert(one.received.end(), buffer, buffer + count);
    return count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR || errno == EIO));
  }

  void accept_all(bool refuse) {
    for (;;) {
      const int fd = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
      if (fd < 0) return;
      if (refuse) {
        close(fd);
        continue;
      }
      const int on = 1;
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
      connections.push_back({fd, {}, Clock::now()});
      connected = static_cast<int>(connections.size());
    }
  }

  void run() {
    while (!leave) {
      std::vector<pollfd> fds;
      if (listener >= 0) fds.push_back({listener, POLLIN, 0});
      if (master >= 0) fds.push_back({master, POLLIN, 0});
      for (const Connection& one : connections) fds.push_back({one.fd, POLLIN, 0});
      poll(fds.data(), fds.size(), kLookMs);
      DriveFaults now;
      bool again = false;
      {
        const std::lock_guard lock(mutex);
        advance();
        now = faults;
        std::swap(again, restarting);
      }
      if (again) hang_up_all();
      const auto readable = [&fds](int fd) {
        for (const pollfd& one : fds) {
          if (one.fd == fd) return one.revents != 0;
        }
        return false;
      };
      if (listener >= 0 && readable(listener)) accept_all(now.refuse_connections);
      for (std::size_t i = 0; i < connections.size();) {
        Connection& one = connections[i];
        const bool alive = !readable(one.fd) || (receive(one) && serve_tcp(one, now));
        if (alive && !now.refuse_connections) {
          ++i;
          continue;
        }
        close(one.fd);
        connections.erase(connections.begin() + static_cast<std::ptrdiff_t>(i));
        connected = static_cast<int>(connections.size());
      }
      if (master >= 0 && readable(master)) {
        // After a silence a new request begins, whatever was left.
        if (Clock::now() - serial.last > std::chrono::milliseconds(50)) serial.received.clear();
        serial.last = Clock::now();
        receive(serial);
        serve_serial(now);
      }
    }
  }
};

EmulatedDrive::EmulatedDrive(const Options& options) : state_(std::make_unique<State>()) {
  State& s = *state_;
  s.options = options;
  s.registers = registers_of(options.make);
  if (options.make == Make::kOrientalAz) s.motor.enable(true);  // it is, by its own input, from power-up on
  if (options.tcp_port >= 0) s.listen_on_tcp();
  if (options.serial) s.open_pty();
  s.thread = std::thread([&s] { s.run(); });
}

EmulatedDrive::~EmulatedDrive() {
  State& s = *state_;
  s.leave = true;
  s.thread.join();
  s.hang_up_all();
  for (const int fd : {s.listener, s.master, s.slave}) {
    if (fd >= 0) close(fd);
  }
}

int EmulatedDrive::port() const {
  return state_->bound_port;
}

std::string EmulatedDrive::serial_port() const {
  return state_->serial_path;
}

void EmulatedDrive::set_faults(const DriveFaults& faults) {
  const std::lock_guard lock(state_->mutex);
  state_->faults = faults;
}

EmulatedMotor EmulatedDrive::motor() const {
  const std::lock_guard lock(state_->mutex);
  state_->advance();
  return state_->motor;
}

void EmulatedDrive::raise_alarm(std::uint16_t code) {
  const std::lock_guard lock(state_->mutex);
  state_->motor.raise_alarm(code);
}

void EmulatedDrive::hold(bool held) {
  const std::lock_guard lock(state_->mutex);
  state_->motor.hold(held);
}

void EmulatedDrive::turn_by_hand(double degrees) {
  const std::lock_guard lock(state_->mutex);
  state_->motor.turn_by_hand(degrees);
}

void EmulatedDrive::restart() {
  const std::lock_guard lock(state_->mutex);
  state_->motor.restart();
  state_->registers->clear();
  if (state_->options.make == Make::kOrientalAz) state_->motor.enable(true);
  state_->restarting = true;
}

std::uint64_t EmulatedDrive::requests() const {
  return state_->requests;
}

int EmulatedDrive::connections() const {
  return state_->connected;
}

}  // namespace hapticd::test
