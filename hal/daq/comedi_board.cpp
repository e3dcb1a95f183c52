#include <comedilib.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>

#include "hal/daq/board_factory.h"
#include "hal/daq/comedi_acquisition.h"
#include "hal/daq/comedi_channels.h"
#include "hal/lock/mutex.h"

namespace hapticd::daq {

namespace {

/// A board behind comedi. Inputs and motion have separate handles, so that the acquisition can reopen its
/// handle while the tick uses the other. Writing all outputs, or reading all counters, is one instruction
/// list: one system call.
class ComediBoard final : public Board {
 public:
  explicit ComediBoard(const BoardConfig& config) : config_(config), acquisition_(config) {}
  ~ComediBoard() override {
    if (motion_) close(BoardUse::kMotion);
  }

  BoardInfo info() const override {
    const MutexLock lock(info_mutex_);
    BoardInfo info = info_;
    info.driver = "comedi";
    info.inputs = config_.comedi.input_channels.size() + config_.spare_channels.size();
    info.input_low_v = acquisition_.low_v();
    info.input_high_v = acquisition_.high_v();
    info.input_bits = acquisition_.bits();
    info.scan_rate_hz = config_.scan_rate_hz;
    info.outputs = config_.comedi.output_channels.size();
    info.counters = config_.comedi.counters.size();
    return info;
  }

  void describe(hal::PartReport& report) const override {
    const BoardInfo board = info();
    report.connection =
        fmt::format("comedi {}{}{}, {} inputs at {} Hz", config_.comedi.device,
                    board.model.empty() ? "" : " ", board.model, board.inputs, board.scan_rate_hz);
    acquisition_.describe(report);
    report.figures.push_back({"board_outputs_refused", static_cast<double>(refused_outputs()), ""});
    report.figures.push_back({"board_counter_failures",
                              static_cast<double>(counter_failures_.load(std::memory_order_relaxed)), ""});
  }

 protected:
  std::optional<hal::Error> open(BoardUse use) override {
    return use == BoardUse::kInputs ? acquisition_.start() : open_motion();
  }

  void close(BoardUse use) noexcept override {
    if (use == BoardUse::kInputs) {
      acquisition_.stop();
      return;
    }
    constexpr std::array<double, kMaxOutputs> kZero{};
    put_volts(std::span(kZero).first(outputs_.size()));
    motion_.reset();
  }

  ScanReading take_scans(std::span<Scan> scans) noexcept override { return acquisition_.read(scans); }

  bool read_raw_counters(std::span<std::uint64_t> raw) noexcept override {
    std::array<comedi_insn, kMaxCounters> instructions{};
    std::array<lsampl_t, kMaxCounters> data{};
    const std::size_t n = raw.size();
    if (!motion_ || n > config_.comedi.counters.size()) return false;
    for (std::size_t i = 0; i < n; ++i) {
      const auto& [subdevice, channel] = config_.comedi.counters[i];
      instructions[i].insn = INSN_READ;
      instructions[i].n = 1;
      instructions[i].data = &data[i];
      instructions[i].subdev = static_cast<unsigned>(subdevice);
      instructions[i].chanspec = CR_PACK(static_cast<unsigned>(channel), 0, 0);
    }
    if (!perform(std::span(instructions).first(n))) {
      counter_failures_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    std::copy_n(data.begin(), n, raw.begin());
    return true;
  }

  bool put_volts(std::span<const double> volts) noexcept override {
    std::array<comedi_insn, kMaxOutputs> instructions{};
    std::array<lsampl_t, kMaxOutputs> data{};
    const std::size_t n = volts.size();
    if (!motion_ || n > outputs_.size()) return false;
    for (std::size_t i = 0; i < n; ++i) {
      const AnalogChannel& output = outputs_[i];
      data[i] = to_count(output, volts[i]);
      instructions[i].insn = INSN_WRITE;
      instructions[i].n = 1;
      instructions[i].data = &data[i];
      instructions[i].subdev = output.subdevice;
      instructions[i].chanspec = CR_PACK(output.channel, output.range, output.reference);
    }
    return perform(std::span(instructions).first(n));
  }

 private:
  bool perform(std::span<comedi_insn> instructions) noexcept {
    if (instructions.empty()) return true;
    comedi_insnlist list{};
    list.n_insns = static_cast<unsigned>(instructions.size());
    list.insns = instructions.data();
    return comedi_do_insnlist(motion_.get(), &list) == static_cast<int>(instructions.size());
  }

  std::optional<hal::Error> open_motion() {
    const ComediConfig& comedi = config_.comedi;
    auto opened = open_comedi(comedi.device);
    if (!opened) return opened.error();
    comedi_t* const device = opened->get();
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      auto found = find_analog(device, comedi,
                               {.subdevice = comedi.output_subdevice,
                                .channel = comedi.output_channels[i],
                                .low_v = comedi.output_low_v,
                                .high_v = comedi.output_high_v,
                                .output = true});
      if (!found) return found.error();
      outputs_[i] = *found;
    }
    int bits = 0;
    for (const auto& [subdevice, channel] : comedi.counters) {
      const auto where = static_cast<unsigned>(subdevice);
      const auto which = static_cast<unsigned>(channel);
      const lsampl_t most = comedi_get_subdevice_type(device, where) == COMEDI_SUBD_COUNTER
                                ? comedi_get_maxdata(device, where, which)
                                : 0;
      const int width = bits_of(most);
      if (most == 0 || (bits != 0 && width != bits)) {
        return hal::Error{most == 0 ? "the board has no such counter" : "the counters have different widths",
                          comedi.device, fmt::format("subdevice {}, channel {}", where, which),
                          "counters of the same width", "see comedi_board_info for the board's counters"};
      }
      bits = width;
      if (comedi.counter_setup == CounterSetup::kNiQuadrature && !set_up_ni_quadrature(device, where)) {
        return comedi_error(comedi.device, "cannot set up a counter for an encoder",
                            "use counter_setup = \"as_is\" if the board's counters need no setup");
      }
    }
    const char* const name = comedi_get_board_name(device);
    {
      const MutexLock lock(info_mutex_);
      info_.model = name != nullptr ? name : "";
      info_.counter_bits = bits == 0 ? 32 : bits;
      info_.output_low_v = outputs_.front().low_v;
      info_.output_high_v = outputs_.front().high_v;
      info_.output_bits = bits_of(outputs_.front().most);
    }
    motion_ = std::move(*opened);
    return std::nullopt;
  }

  /// Sets up a general-purpose counter for an encoder: four counts a line, direction from the phase of the
  /// two signals.
  static bool set_up_ni_quadrature(comedi_t* device, unsigned subdevice) {
    bool fit = comedi_reset(device, subdevice) >= 0;
    // The start value and the two values it can be loaded with.
    for (unsigned channel = 0; channel < 3; ++channel) {
      fit = fit && comedi_data_write(device, subdevice, channel, 0, 0, 0) >= 0;
    }
    fit = fit && comedi_set_gate_source(device, subdevice, 0, 0, NI_GPCT_DISABLED_GATE_SELECT) >= 0;
    fit = fit && comedi_set_gate_source(device, subdevice, 0, 1, NI_GPCT_DISABLED_GATE_SELECT) >= 0;
    constexpr unsigned kMode =
        NI_GPCT_COUNTING_MODE_QUADRATURE_X4_BITS | NI_GPCT_COUNTING_DIRECTION_HW_UP_DOWN_BITS;
    fit = fit && comedi_set_counter_mode(device, subdevice, 0, kMode) >= 0;
    return fit && comedi_arm(device, subdevice, NI_GPCT_ARM_IMMEDIATE) >= 0;
  }

  const BoardConfig config_;
  ComediAcquisition acquisition_;
  ComediHandle motion_;
  std::array<AnalogChannel, 3> outputs_{};
  mutable Mutex info_mutex_;  ///< never taken by the tick
  BoardInfo info_ GUARDED_BY(info_mutex_);
  std::atomic<std::uint64_t> counter_failures_{0};
};

}  // namespace

hal::Result<std::shared_ptr<Board>> create_comedi_board(const BoardConfig& config) {
  return std::shared_ptr<Board>(std::make_shared<ComediBoard>(config));
}

bool has_comedi() noexcept {
  return true;
}

}  // namespace hapticd::daq
