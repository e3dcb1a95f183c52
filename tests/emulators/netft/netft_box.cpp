#include "tests/emulators/netft/netft_box.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <ctime>
#include <map>
#include <sstream>
#include <stdexcept>

#include "tests/support/system/loopback.h"
#include "tests/support/system/monotonic_ns.h"

namespace hapticd::emulators {

namespace {

using test::monotonic_ns;

constexpr std::size_t kRecordBytes = 36;

/// N, or N·mm, in one of the unit.
double unit_in_house_units(const std::string& unit) {
  static const std::map<std::string, double> kUnits{{"N", 1.0},
                                                    {"kN", 1000.0},
                                                    {"lbf", 4.44822161526},
                                                    {"klbf", 4448.22161526},
                                                    {"kgf", 9.80665},
                                                    {"gf", 0.00980665},
                                                    {"Nm", 1000.0},
                                                    {"N-m", 1000.0},
                                                    {"Nmm", 1.0},
                                                    {"N-mm", 1.0},
                                                    {"kNm", 1e6},
                                                    {"lbf-in", 112.984829027616},
                                                    {"lbf-ft", 1355.81794833},
                                                    {"kgf-cm", 98.0665}};
  const auto found = kUnits.find(unit);
  return found != kUnits.end() ? found->second : 1.0;
}

void put(std::vector<std::uint8_t>& bytes, std::uint32_t word) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<std::uint8_t>(word >> shift));
}

/// Port 0 becomes a free one.
int open_udp(int& port) {
  const int descriptor = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in address = test::loopback(port);
  socklen_t length = sizeof address;
  if (descriptor < 0 || bind(descriptor, reinterpret_cast<sockaddr*>(&address), length) != 0 ||
      getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length) != 0) {
    throw std::runtime_error("the emulated box has no UDP socket");
  }
  port = ntohs(address.sin_port);
  return descriptor;
}

}  // namespace

NetFtBox::NetFtBox(const NetFtBoxSettings& settings)
    : settings_(settings), udp_port_(settings.udp_port), random_(settings.seed) {
  socket_ = open_udp(udp_port_);
  // So that the kernel says when the client's port is closed.
  const int on = 1;
  setsockopt(socket_, IPPROTO_IP, IP_RECVERR, &on, sizeof on);
  int stranger_port = 0;
  stranger_ = open_udp(stranger_port);
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  rdt_sequence_ = settings.first_rdt_sequence;
  ft_sequence_ = settings.first_ft_sequence;
  if (settings.has_page) page_ = std::make_unique<HttpPage>("/netftapi2.xml", settings.http_port);
  publish_page();
  thread_ = std::thread([this] { run(); });
}

NetFtBox::~NetFtBox() {
  stopping_.store(true);
  eventfd_write(wake_, 1);
  thread_.join();
  close(socket_);
  close(stranger_);
  close(wake_);
}

int NetFtBox::http_port() const noexcept {
  if (page_) return page_->port();
  return udp_port_;  // nothing listens there with TCP: the kernel gave the number for UDP only
}

std::string NetFtBox::page_text() const {
  const std::lock_guard lock(mutex_);
  return compose_page();
}

std::string NetFtBox::compose_page() const {
  const double force = unit_in_house_units(settings_.force_unit);
  const double torque = unit_in_house_units(settings_.torque_unit);
  std::ostringstream xml;
  xml.precision(10);
  xml << "<?xml version=\"1.0\"?>\n<netft>\n<runstat>0x00000000</runstat>\n<runft>0;0;0;0;0;0</runft>\n"
      << "<runrate>7000</runrate>\n<setcfgsel>0</setcfgsel>\n<setuserfilter>" << settings_.user_filter
      << "</setuserfilter>\n<setbias>";
  for (std::size_t i = 0; i < 6; ++i) {
    xml << (i > 0 ? ";" : "") << std::lround(1000.0 * bias_[i] + (biased_ ? 1.0 : 0.0));
  }
  xml << "</setbias>\n<cfgnam>Default</cfgnam>\n<cfgcalsel>0</cfgcalsel>\n<cfgcalsn>" << settings_.serial
      << "</cfgcalsn>\n<scfgfu>" << settings_.force_unit << "</scfgfu>\n<scfgtu>" << settings_.torque_unit
      << "</scfgtu>\n<cfgtfx>" << settings_.tool_transformation << "</cfgtfx>\n<cfgcpf>"
      << settings_.counts_per_force << "</cfgcpf>\n<cfgcpt>" << settings_.counts_per_torque
      << "</cfgcpt>\n<cfgmr>";
  for (const double range_n : settings_.force_range_n) xml << range_n / force << ";";
  for (int i = 0; i < 3; ++i) xml << settings_.torque_range_n_mm / torque << (i < 2 ? ";" : "");
  xml << "</cfgmr>\n<comrdte>" << (settings_.rdt_enabled ? "Enabled" : "Disabled")
      << "</comrdte>\n<comrdtrate>" << settings_.rate_hz
      << "</comrdtrate>\n<comrdtbsiz>1</comrdtbsiz>\n<mfgdigver>2.2.59</mfgdigver>\n<prodname>"
      << settings_.product << "</prodname>\n</netft>\n";
  return xml.str();
}

void NetFtBox::publish_page() {
  if (page_) page_->set_text(compose_page());
}

bool NetFtBox::chance(double probability) {
  return probability > 0.0 && std::uniform_real_distribution<double>(0.0, 1.0)(random_) < probability;
}

void NetFtBox::load(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  const std::lock_guard lock(mutex_);
  load_ = {force_n.x, force_n.y, force_n.z, torque_n_mm.x, torque_n_mm.y, torque_n_mm.z};
}

void NetFtBox::feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  const std::lock_guard lock(mutex_);
  load_ = {force_n.x, force_n.y, force_n.z, torque_n_mm.x, torque_n_mm.y, torque_n_mm.z};
  if (monotonic_ns() >= dead_until_ns_) make_record();
}

void NetFtBox::set_offset(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm) {
  const std::lock_guard lock(mutex_);
  offset_ = {force_n.x, force_n.y, force_n.z, torque_n_mm.x, torque_n_mm.y, torque_n_mm.z};
}

void NetFtBox::send_garbage(int datagrams) {
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < datagrams; ++i) {
    std::size_t length = 1 + random_() % 1500;
    if (length % kRecordBytes == 0) ++length;
    Bytes bytes(length);
    std::generate(bytes.begin(), bytes.end(), [this] { return static_cast<std::uint8_t>(random_()); });
    emit(bytes);
  }
}

void NetFtBox::send_short(int datagrams) {
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < datagrams; ++i) {
    Bytes bytes = encode();
    bytes.resize(random_() % kRecordBytes);
    emit(bytes);
  }
}

void NetFtBox::send_long(int datagrams) {
  const std::lock_guard lock(mutex_);
  for (int i = 0; i < datagrams; ++i) {
    Bytes bytes = encode();
    bytes.resize(kRecordBytes + 1 + random_() % (kRecordBytes - 1));
    emit(bytes);
  }
}

void NetFtBox::send_wild_number() {
  const std::lock_guard lock(mutex_);
  const std::uint32_t honest = rdt_sequence_;
  rdt_sequence_ += 0x5000'0000U;
  emit(encode());
  rdt_sequence_ = honest;
}

void NetFtBox::send_from_stranger(int datagrams) {
  const std::lock_guard lock(mutex_);
  if (!client_) return;
  for (int i = 0; i < datagrams; ++i) {
    const Bytes bytes = encode();
    sendto(stranger_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&*client_),
           sizeof *client_);
  }
}

void NetFtBox::restart(double silence_s) {
  const std::lock_guard lock(mutex_);
  dead_until_ns_ = monotonic_ns() + std::llround(1e9 * silence_s);
  client_.reset();
  delayed_.clear();
  held_back_.reset();
  rdt_sequence_ = settings_.first_rdt_sequence;
  ft_sequence_ = 0;
  bias_ = {};
  biased_ = false;
  latched_ = false;
  publish_page();
}

void NetFtBox::skip_numbers(std::uint32_t count) {
  const std::lock_guard lock(mutex_);
  rdt_sequence_ += count;
  ft_sequence_ += count;
}

void NetFtBox::restart_numbers() {
  const std::lock_guard lock(mutex_);
  rdt_sequence_ = 0;
  ft_sequence_ = 0;
  bias_ = {};
  biased_ = false;
  publish_page();
}

void NetFtBox::take_bias() {
  for (std::size_t i = 0; i < 6; ++i) bias_[i] = load_[i] + offset_[i];
  biased_ = true;
  publish_page();
}

void NetFtBox::bias_by_another() {
  const std::lock_guard lock(mutex_);
  take_bias();
}

void NetFtBox::give_stream_away() {
  const std::lock_guard lock(mutex_);
  client_.reset();
}

void NetFtBox::change_settings(const NetFtBoxSettings& settings) {
  const std::lock_guard lock(mutex_);
  settings_ = settings;
  publish_page();
}

bool NetFtBox::streaming() const {
  const std::lock_guard lock(mutex_);
  return client_.has_value();
}
int NetFtBox::commands(std::uint16_t command) const {
  const std::lock_guard lock(mutex_);
  return command < 256 ? commands_[command] : 0;
}
int NetFtBox::commands_unheard() const {
  const std::lock_guard lock(mutex_);
  return commands_unheard_;
}
int NetFtBox::invalid_requests() const {
  const std::lock_guard lock(mutex_);
  return invalid_requests_;
}
bool NetFtBox::client_gone() const {
  const std::lock_guard lock(mutex_);
  return client_gone_;
}

NetFtBox::Bytes NetFtBox::encode() {
  Bytes bytes;
  bytes.reserve(kRecordBytes);
  put(bytes, rdt_sequence_);
  put(bytes, ft_sequence_);
  put(bytes, latched_ ? status_ | 0x8001'0000U : status_);
  for (std::size_t i = 0; i < 6; ++i) {
    const double unit = unit_in_house_units(i < 3 ? settings_.force_unit : settings_.torque_unit);
    const double counts_per_unit = i < 3 ? settings_.counts_per_force : settings_.counts_per_torque;
    const double reading = load_[i] + offset_[i] - bias_[i];
    const double counts =
        std::clamp(std::round(reading / unit * counts_per_unit), -2147483648.0, 2147483647.0);
    put(bytes, static_cast<std::uint32_t>(saturated_counts_ ? *saturated_counts_
                                                            : static_cast<std::int32_t>(counts)));
  }
  return bytes;
}

void NetFtBox::make_record() {
  ++ft_sequence_;
  if (!client_) return;
  Bytes bytes = encode();
  ++rdt_sequence_;
  made_.fetch_add(1);
  if (remaining_ > 0 && --remaining_ == 0) {
    deliver(std::move(bytes));
    client_.reset();
    return;
  }
  if (settings_.records_per_datagram <= 1) {
    deliver(std::move(bytes));
    return;
  }
  buffered_.insert(buffered_.end(), bytes.begin(), bytes.end());
  if (++buffered_records_ < settings_.records_per_datagram) return;
  deliver(std::move(buffered_));
  buffered_.clear();
  buffered_records_ = 0;
}

void NetFtBox::deliver(Bytes bytes) {
  if (silent_) return;
  if (drop_ > 0) {
    --drop_;
    return;
  }
  if (chance(loss_)) return;
  if (held_back_) {
    const Bytes earlier = std::move(*held_back_);
    held_back_.reset();
    transmit(bytes);
    transmit(earlier);
    return;
  }
  if (swap_ > 0 || chance(reordering_)) {
    if (swap_ > 0) --swap_;
    held_back_ = std::move(bytes);
    return;
  }
  transmit(bytes);
  if (duplicate_ > 0 || chance(duplication_)) {
    if (duplicate_ > 0) --duplicate_;
    transmit(bytes);
  }
}

void NetFtBox::transmit(const Bytes& bytes) {
  if (delay_ns_ <= 0) {
    emit(bytes);
    return;
  }
  delayed_.push_back({monotonic_ns() + delay_ns_, bytes});
  eventfd_write(wake_, 1);
}

void NetFtBox::emit(const Bytes& bytes) {
  if (!client_) return;
  if (sendto(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&*client_),
             sizeof *client_) < 0 &&
      errno == ECONNREFUSED) {
    client_gone_ = true;
  }
}

void NetFtBox::take_requests(std::int64_t now) {
  std::array<std::uint8_t, 64> bytes{};
  for (;;) {
    sockaddr_in sender{};
    socklen_t length = sizeof sender;
    const ssize_t n =
        recvfrom(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&sender), &length);
    if (n < 0 && errno == ECONNREFUSED) {
      client_gone_ = true;
      continue;
    }
    if (n < 0) return;
    if (deaf_) ++commands_unheard_;
    if (deaf_ || now < dead_until_ns_) continue;
    if (n != 8 || bytes[0] != 0x12 || bytes[1] != 0x34) {
      ++invalid_requests_;
      continue;
    }
    const unsigned command = bytes[2] * 256U + bytes[3];
    if (command < 256) ++commands_[command];
    switch (command) {
      case 0:
        client_.reset();
        break;
      case 2:
      case 3:
        if (!settings_.rdt_enabled) break;
        client_ = sender;
        client_gone_ = false;
        remaining_ = (std::uint32_t{bytes[4]} << 24U) | (std::uint32_t{bytes[5]} << 16U) |
                     (std::uint32_t{bytes[6]} << 8U) | bytes[7];
        if (!settings_.continue_sequence) rdt_sequence_ = settings_.first_rdt_sequence;
        next_record_ns_ = now;
        buffered_.clear();
        buffered_records_ = 0;
        break;
      case 0x41:
        latched_ = false;
        break;
      case 0x42:
        take_bias();
        break;
      default:
        ++invalid_requests_;
    }
  }
}

/// Does what is due and says when the next is.
std::int64_t NetFtBox::work(std::int64_t now) {
  take_requests(now);
  std::int64_t next = now + 1'000'000'000;
  if (now < dead_until_ns_) return std::min(next, dead_until_ns_);
  if (!settings_.fed && client_) {
    const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / settings_.rate_hz));
    // A thread that was late makes up for it, as a box that never is late would have sent all.
    while (client_ && next_record_ns_ <= now) {
      make_record();
      next_record_ns_ += period_ns;
    }
    next = std::min(next, next_record_ns_);
  }
  while (!delayed_.empty() && delayed_.front().due_ns <= now) {
    emit(delayed_.front().bytes);
    delayed_.pop_front();
  }
  if (!delayed_.empty()) next = std::min(next, delayed_.front().due_ns);
  return next;
}

void NetFtBox::run() {
  while (!stopping_.load()) {
    std::int64_t next = 0;
    {
      const std::lock_guard lock(mutex_);
      next = work(monotonic_ns());
    }
    const std::int64_t wait = std::max<std::int64_t>(next - monotonic_ns(), 0);
    const timespec timeout{wait / 1'000'000'000, wait % 1'000'000'000};
    std::array<pollfd, 2> descriptors{{{socket_, POLLIN, 0}, {wake_, POLLIN, 0}}};
    ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr);
    eventfd_t ignored = 0;
    eventfd_read(wake_, &ignored);
  }
}

}  // namespace hapticd::emulators
