#pragma once

#include <array>
#include <cstdint>
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
  void set_wide_samples(bool wide);       ///< 32 bits a sample, 18 bits of them used; else 16
  void set_fastest_scan_ns(unsigned ns);  ///< faster commands are slowed down
  void set_soft_calibrated(bool soft, const std::string& file);
  void set_busy(bool busy);  ///< another program holds the inputs

  // The world.
  void set_inputs_v(const std::array<double, 16>& volts);
  void set_counters(const std::array<std::uint32_t, 8>& counts);
  std::array<std::uint32_t, 4> output_counts() const;
  std::vector<std::string> setup_calls() const;  ///< of the counters
  int opened() const;                            ///< handles that are open now
  std::uint64_t commands() const;                ///< streams that were started
  std::vector<unsigned> last_channels() const;   ///< channel list of the last stream
  bool wakes_every_scan() const;

  // Faults.
  void end_stream();       ///< the command stops, as when the board is pulled out
  void overflow_stream();  ///< the kernel's buffer is full
  void mute_stream(bool muted);
  void split_writes(bool split);  ///< scans arrive in pieces
  void fail_instructions(bool failing);
};

}  // namespace hapticd::emulators
