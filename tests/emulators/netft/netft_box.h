#pragma once

#include <netinet/in.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "hal/samples.h"
#include "tests/emulators/netft/http_page.h"

namespace hapticd::emulators {

/// What the box is and how it is set.
struct NetFtBoxSettings {
  std::string product = "Net F/T";
  std::string serial = "FT12345";
  double counts_per_force = 1e6;   ///< per force_unit
  double counts_per_torque = 1e6;  ///< per torque_unit
  std::string force_unit = "N";    ///< N, kN, lbf, klbf, kgf, gf
  std::string torque_unit = "Nm";  ///< Nm, Nmm, kNm, lbf-in, lbf-ft, kgf-cm
  std::array<double, 3> force_range_n{25.0, 25.0, 35.0};
  double torque_range_n_mm = 250.0;
  double rate_hz = 7000.0;  ///< as the page says; and, unless fed, as it sends
  int user_filter = 0;
  bool rdt_enabled = true;
  std::string tool_transformation = "0;0;0;0;0;0";
  bool fed = false;      ///< true: sends a record for each feed(), none by itself
  bool has_page = true;  ///< false: no HTTP at all
  int udp_port = 0;      ///< 0: any free one
  int http_port = 0;
  int records_per_datagram = 1;
  std::uint32_t first_rdt_sequence = 1;
  std::uint32_t first_ft_sequence = 100'000;
  bool continue_sequence = false;  ///< a new request does not begin the stream's numbers again
  std::uint64_t seed = 1;
};

/// A box as the manufacturer's manual describes it, on 127.0.0.1, with faults to order. It shares nothing
/// with the driver it is to prove: constants, units and the layout of bytes are its own.
///
/// All may be called from any thread. Faults count datagrams; "next" ones are used up one by one.
class NetFtBox {
 public:
  explicit NetFtBox(const NetFtBoxSettings& settings = {});
  ~NetFtBox();
  NetFtBox(const NetFtBox&) = delete;
  NetFtBox& operator=(const NetFtBox&) = delete;

  int udp_port() const noexcept { return udp_port_; }
  int http_port() const noexcept;  ///< a port without a listener if there is no page
  HttpPage& page() { return *page_; }
  /// The page as its settings make it.
  std::string page_text() const;

  /// The load on the sensor, in its own axes, from now on [N, N·mm].
  void load(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);
  /// Feeds a load, and sends one record if a client has asked for the stream.
  void feed(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);
  /// What the gages read without a load, before any bias [N, N·mm].
  void set_offset(const hal::Vector3& force_n, const hal::Vector3& torque_n_mm);

  void set_rate_hz(double rate_hz) { assign(settings_.rate_hz, rate_hz); }
  void set_status(std::uint32_t status) { assign(status_, status); }
  void latch_condition() { assign(latched_, true); }  ///< 0x80010000 until reset by command
  void saturate_counts(std::optional<std::int32_t> counts) {
    assign(saturated_counts_, counts);
  }                                                          ///< all six read so
  void set_silent(bool silent) { assign(silent_, silent); }  ///< takes commands and sends nothing: half open
  void set_deaf(bool deaf) { assign(deaf_, deaf); }          ///< takes no command
  void set_loss(double probability) { assign(loss_, probability); }
  void set_duplication(double probability) { assign(duplication_, probability); }
  void set_reordering(double probability) {
    assign(reordering_, probability);
  }  ///< held back until the one after it is sent
  void set_delay_s(double seconds) { assign(delay_ns_, std::int64_t{std::llround(1e9 * seconds)}); }
  void drop_next(int datagrams) { add(drop_, datagrams); }
  void duplicate_next(int datagrams) { add(duplicate_, datagrams); }
  void swap_next(int pairs) { add(swap_, pairs); }
  void send_garbage(int datagrams);        ///< random bytes, of random length up to 1500
  void send_short(int datagrams);          ///< a record cut off
  void send_long(int datagrams);           ///< a record and some bytes
  void send_wild_number();                 ///< a whole record with a sequence number out of all order
  void send_from_stranger(int datagrams);  ///< good records from another port
  /// Restarts as after a power failure: says nothing for a while, forgets bias, client and numbers.
  void restart(double silence_s);
  /// Restarts the numbers only, and goes on sending to its client, as if nothing had happened.
  void restart_numbers();
  /// The next record's number is so much higher, as if the ones between were lost, though no time has passed.
  void skip_numbers(std::uint32_t count);
  /// Biases as another client: the box takes a bias from any client, and does not inform the others.
  void bias_by_another();
  /// Another client takes the stream, as the box lets it.
  void give_stream_away();
  void change_settings(const NetFtBoxSettings& settings);

  bool streaming() const;
  std::uint64_t records_made() const noexcept { return made_.load(); }
  int commands(std::uint16_t command) const;  ///< how often it came
  int commands_unheard() const;               ///< that came while it was deaf
  int invalid_requests() const;
  bool client_gone() const;  ///< the kernel says that nothing listens at the client's port any more

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Delayed {
    std::int64_t due_ns;
    Bytes bytes;
  };

  template <class T>
  void assign(T& member, T value) {
    const std::lock_guard lock(mutex_);
    member = value;
  }
  void add(int& member, int number) {
    const std::lock_guard lock(mutex_);
    member += number;
  }
  void run();
  std::int64_t work(std::int64_t now_ns);
  void take_requests(std::int64_t now_ns);
  void take_bias();
  void make_record();
  Bytes encode();
  void deliver(Bytes bytes);
  void transmit(const Bytes& bytes);
  void emit(const Bytes& bytes);
  std::string compose_page() const;
  void publish_page();
  bool chance(double probability);

  mutable std::mutex mutex_;
  NetFtBoxSettings settings_;
  int socket_ = -1;
  int stranger_ = -1;
  int wake_ = -1;
  int udp_port_ = 0;
  std::unique_ptr<HttpPage> page_;
  std::thread thread_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> made_{0};

  std::optional<sockaddr_in> client_;
  std::uint32_t remaining_ = 0;  ///< records still wanted; 0 = until asked to stop
  std::uint32_t rdt_sequence_ = 0;
  std::uint32_t ft_sequence_ = 0;
  std::int64_t next_record_ns_ = 0;
  std::array<double, 6> load_{};    ///< N, N·mm
  std::array<double, 6> offset_{};  ///< N, N·mm
  std::array<double, 6> bias_{};    ///< N, N·mm
  bool biased_ = false;
  int commands_[256] = {};
  int commands_unheard_ = 0;
  int invalid_requests_ = 0;
  bool client_gone_ = false;

  std::mt19937_64 random_;
  std::uint32_t status_ = 0;
  bool latched_ = false;
  std::optional<std::int32_t> saturated_counts_;
  bool silent_ = false;
  bool deaf_ = false;
  double loss_ = 0.0;
  double duplication_ = 0.0;
  double reordering_ = 0.0;
  std::int64_t delay_ns_ = 0;
  int drop_ = 0;
  int duplicate_ = 0;
  int swap_ = 0;
  std::int64_t dead_until_ns_ = 0;
  std::optional<Bytes> held_back_;
  Bytes buffered_;
  int buffered_records_ = 0;
  std::deque<Delayed> delayed_;
};

}  // namespace hapticd::emulators
