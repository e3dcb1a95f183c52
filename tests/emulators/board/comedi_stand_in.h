#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <set>
#include <string>
#include <vector>

namespace hapticd::emulators {

/// A comedi board for programs that link this file's source before libcomedi: it takes the place of the
/// library's calls that would reach a kernel, and leaves the rest (conversion, calibration files) to the
/// library. Subdevices: 0 analog inputs that stream (16 channels), 1 analog outputs (4), 2 digital, 3
/// counters (8). One board, behind any file that is named for it. Preloaded into another program, with
/// COMEDI_STAND_IN_PAGE naming a page (board_page.h), it is the board of the world behind that page.
///
/// The driver's reads of the stream go through the linker's --wrap=read, so that a stream can end the way the
/// kernel ends it after an overflow.
class ComediStandIn {
 public:
  static ComediStandIn& get();

  /// Resets the board to new, behind that path.
  void reset(const std::string& path);

  // What the board is.
  void set_wide_samples(bool wide) { put(board_.wide, wide); }
  void set_fastest_scan_ns(unsigned ns) { put(board_.fastest_ns, ns); }
  void set_soft_calibrated(bool soft, const std::string& file) {
    put(board_.soft, soft);
    put(board_.soft_file, file);
  }
  void set_busy(bool busy) { put(board_.busy, busy); }

  // The world.
  void set_inputs_v(const std::array<double, 16>& volts) { put(board_.inputs_v, volts); }
  void set_counters(const std::array<std::uint32_t, 8>& counts) { put(board_.counters, counts); }
  std::array<std::uint32_t, 4> output_counts() const { return seen(board_.outputs); }
  std::vector<std::string> setup_calls() const { return seen(board_.setup); }
  int opened() const { return seen(board_.opened); }
  std::uint64_t commands() const { return seen(board_.commands); }
  std::vector<unsigned> last_channels() const { return seen(board_.channels); }
  bool wakes_every_scan() const { return seen(board_.wakes_every_scan); }

  // Faults.
  void end_stream() { put(board_.end_at, commands()); }  ///< as when the board is pulled out
  void overflow_stream();                                ///< the kernel's buffer is full
  void mute_stream(bool muted) { put(board_.muted, muted); }
  void split_writes(bool split) { put(board_.split, split); }  ///< scans arrive in pieces
  void fail_instructions(bool failing) { put(board_.failing, failing); }

  /// All that is guarded by its mutex.
  struct Board {
    mutable std::mutex mutex;
    std::string path;
    bool wide = false;             ///< 32 bits a sample, 18 bits of them used; else 16
    unsigned fastest_ns = 10'000;  ///< faster commands are slowed down
    bool soft = false;
    std::string soft_file;
    bool busy = false;  ///< another program holds the inputs
    std::array<double, 16> inputs_v{};
    std::array<std::uint32_t, 8> counters{};
    std::array<std::uint32_t, 4> outputs{};
    std::vector<std::string> setup;  ///< calls that set the counters up
    int opened = 0;                  ///< handles that are open now
    std::uint64_t commands = 0;      ///< streams that were started
    std::vector<unsigned> channels;  ///< of the last stream
    bool wakes_every_scan = false;
    bool muted = false;
    bool split = false;
    bool failing = false;
    std::uint64_t end_at = 0;  ///< streams up to this number end
    std::set<int> overflowed;  ///< read ends
    std::set<int> streaming;   ///< read ends
  };
  Board& board() { return board_; }

 private:
  template <class T>
  void put(T& into, const T& value) {
    const std::lock_guard lock(board_.mutex);
    into = value;
  }
  template <class T>
  T seen(const T& value) const {
    const std::lock_guard lock(board_.mutex);
    return value;
  }

  Board board_;
};

}  // namespace hapticd::emulators
