#include "tests/emulators/board/comedi_stand_in.h"

#include <comedilib.h>
#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <thread>

#include "tests/emulators/board/board_page.h"

struct comedi_t_struct {
  int read_end = -1;
  int write_end = -1;
  unsigned read_subdevice = 0;
  std::thread pump;
  std::atomic<bool> stop{false};
};

namespace {

hapticd::emulators::ComediStandIn::Board& board() {
  return hapticd::emulators::ComediStandIn::get().board();
}

/// Page of the world in another process, if there is one: named in the environment, and the board's node.
hapticd::emulators::BoardPage* world() {
  using hapticd::emulators::BoardPage;
  static const std::unique_ptr<BoardPage> the_one = [] {
    const char* const path = std::getenv("COMEDI_STAND_IN_PAGE");
    if (path == nullptr) return std::unique_ptr<BoardPage>();
    board().path = path;
    return std::make_unique<BoardPage>(path, BoardPage::Join{});
  }();
  return the_one.get();
}

/// What the world shows now; with the board's mutex held.
void look_at_world() {
  if (const auto* const page = world()) page->read_world(board().inputs_v, board().counters);
}

thread_local int t_error = 0;
int fail(int error) {
  t_error = error;
  errno = error;
  return -1;
}

constexpr double kEndV[] = {10.0, 5.0, 1.0};
comedi_range g_ranges[] = {{-10.0, 10.0, UNIT_volt}, {-5.0, 5.0, UNIT_volt}, {-1.0, 1.0, UNIT_volt}};

unsigned most_of(unsigned subdevice) {
  if (subdevice == 0) return board().wide ? (1U << 18U) - 1U : 0xffffU;
  return subdevice == 3 ? (1U << 24U) - 1U : 0xffffU;
}

/// Writes all of it unless asked to stop; a full pipe is waited for.
bool write_all(comedi_t* device, const unsigned char* bytes, std::size_t size) {
  while (size > 0) {
    if (device->stop.load()) return false;
    const ssize_t put = ::write(device->write_end, bytes, size);
    if (put > 0) {
      bytes += put;
      size -= static_cast<std::size_t>(put);
    } else if (errno == EAGAIN) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    } else {
      return false;
    }
  }
  return true;
}

void pump(comedi_t* device, std::uint64_t number, const std::vector<unsigned>& channels, unsigned period_ns) {
  auto next = std::chrono::steady_clock::now();
  while (!device->stop.load()) {
    std::vector<unsigned char> bytes;
    bool split = false;
    {
      const std::lock_guard lock(board().mutex);
      if (number <= board().end_at) break;
      if (!board().muted) {
        look_at_world();
        for (const unsigned packed : channels) {
          const double end_v = kEndV[CR_RANGE(packed)];
          const double share = (board().inputs_v[CR_CHAN(packed)] + end_v) / (2.0 * end_v);
          const double most = most_of(0);
          const auto count =
              static_cast<std::uint32_t>(std::lround(std::fmin(std::fmax(share, 0.0), 1.0) * most));
          const std::size_t size = board().wide ? 4 : 2;
          for (std::size_t k = 0; k < size; ++k)
            bytes.push_back(static_cast<unsigned char>(count >> (8 * k)));
        }
      }
      split = board().split;
    }
    if (split && bytes.size() > 3) {
      if (!write_all(device, bytes.data(), 3)) break;
      std::this_thread::sleep_for(std::chrono::microseconds(300));
      if (!write_all(device, bytes.data() + 3, bytes.size() - 3)) break;
    } else if (!write_all(device, bytes.data(), bytes.size())) {
      break;
    }
    next += std::chrono::nanoseconds(period_ns);
    std::this_thread::sleep_until(next);
  }
  ::close(device->write_end);  // the reader sees the end
  device->write_end = -1;
}

void end(comedi_t* device) {
  device->stop.store(true);
  if (device->pump.joinable()) device->pump.join();
  const std::lock_guard lock(board().mutex);
  board().streaming.erase(device->read_end);
  board().overflowed.erase(device->read_end);
  if (device->read_end >= 0) ::close(device->read_end);
  device->read_end = -1;
}

void note(const std::string& call) {
  const std::lock_guard lock(board().mutex);
  board().setup.push_back(call);
}

}  // namespace

namespace hapticd::emulators {

ComediStandIn& ComediStandIn::get() {
  static ComediStandIn the_one;
  return the_one;
}
void ComediStandIn::reset(const std::string& path) {
  Board& b = board();
  const std::lock_guard lock(b.mutex);
  b.path = path;
  b.wide = b.soft = b.busy = b.muted = b.split = b.failing = b.wakes_every_scan = false;
  b.fastest_ns = 10'000;
  b.inputs_v = {};
  b.counters = {};
  b.outputs = {};
  b.setup.clear();
  b.channels.clear();
  b.overflowed.clear();
}
void ComediStandIn::overflow_stream() {
  const std::lock_guard lock(board().mutex);
  board().overflowed = board().streaming;
}

}  // namespace hapticd::emulators

extern "C" {

// The names are the linker's.
// NOLINTBEGIN(bugprone-reserved-identifier)
#ifndef COMEDI_STAND_IN_PRELOADED
ssize_t __real_read(int file, void* into, size_t size);
ssize_t __wrap_read(int file, void* into, size_t size);
ssize_t __wrap_read(int file, void* into, size_t size) {
  {
    const std::lock_guard lock(board().mutex);
    if (board().overflowed.contains(file)) {
      errno = EPIPE;
      return -1;
    }
  }
  return __real_read(file, into, size);
}
#endif
// NOLINTEND(bugprone-reserved-identifier)

comedi_t* comedi_open(const char* path) {
  const std::lock_guard lock(board().mutex);
  world();
  if (board().path != path) {
    fail(ENODEV);
    return nullptr;
  }
  ++board().opened;
  return new comedi_t_struct;
}

int comedi_close(comedi_t* device) {
  end(device);
  delete device;
  const std::lock_guard lock(board().mutex);
  --board().opened;
  return 0;
}

int comedi_errno(void) {
  return t_error;
}
const char* comedi_strerror(int error) {
  return std::strerror(error);
}
int comedi_fileno(comedi_t* device) {
  return device->read_end;
}
const char* comedi_get_board_name(comedi_t*) {
  return "stand-in-16";
}
int comedi_get_read_subdevice(comedi_t* device) {
  return static_cast<int>(device->read_subdevice);
}
int comedi_set_read_subdevice(comedi_t*, unsigned int) {
  return fail(EINVAL);
}
int comedi_get_subdevice_type(comedi_t*, unsigned int subdevice) {
  constexpr int kTypes[] = {COMEDI_SUBD_AI, COMEDI_SUBD_AO, COMEDI_SUBD_DIO, COMEDI_SUBD_COUNTER};
  return subdevice < 4 ? kTypes[subdevice] : fail(EINVAL);
}
int comedi_find_subdevice_by_type(comedi_t* device, int type, unsigned int first) {
  for (unsigned k = first; k < 4; ++k) {
    if (comedi_get_subdevice_type(device, k) == type) return static_cast<int>(k);
  }
  return fail(EINVAL);
}
int comedi_get_subdevice_flags(comedi_t*, unsigned int) {
  const std::lock_guard lock(board().mutex);
  return (board().wide ? static_cast<int>(SDF_LSAMPL) : 0) | (board().soft ? SDF_SOFT_CALIBRATED : 0);
}
int comedi_get_n_channels(comedi_t*, unsigned int subdevice) {
  constexpr int kChannels[] = {16, 4, 8, 8};
  return kChannels[subdevice];
}
lsampl_t comedi_get_maxdata(comedi_t*, unsigned int subdevice, unsigned int) {
  const std::lock_guard lock(board().mutex);
  return most_of(subdevice);
}
int comedi_find_range(comedi_t*, unsigned int, unsigned int, unsigned int unit, double min, double max) {
  if (unit != UNIT_volt) return fail(EINVAL);
  for (int k = 2; k >= 0; --k) {
    if (-kEndV[k] <= min && kEndV[k] >= max) return k;
  }
  return fail(EINVAL);
}
comedi_range* comedi_get_range(comedi_t*, unsigned int, unsigned int, unsigned int range) {
  return &g_ranges[range];
}
int comedi_get_hardcal_converter(comedi_t*, unsigned subdevice, unsigned, unsigned range,
                                 enum comedi_conversion_direction direction, comedi_polynomial_t* p) {
  const std::lock_guard lock(board().mutex);
  const double step = 2.0 * kEndV[range] / most_of(subdevice);
  *p = {};
  p->order = 1;
  if (direction == COMEDI_TO_PHYSICAL) {
    p->coefficients[0] = -kEndV[range];
    p->coefficients[1] = step;
  } else {
    p->expansion_origin = -kEndV[range];
    p->coefficients[1] = 1.0 / step;
  }
  return 0;
}
char* comedi_get_default_calibration_path(comedi_t*) {
  const std::lock_guard lock(board().mutex);
  return strdup(board().soft_file.c_str());
}

int comedi_get_cmd_generic_timed(comedi_t*, unsigned int subdevice, comedi_cmd* command, unsigned count,
                                 unsigned period_ns) {
  if (subdevice != 0) return fail(EINVAL);
  *command = {};
  command->subdev = subdevice;
  command->start_src = TRIG_NOW;
  command->scan_begin_src = TRIG_TIMER;
  command->scan_begin_arg = period_ns;
  command->convert_src = TRIG_TIMER;
  command->convert_arg = 1000;
  command->scan_end_src = TRIG_COUNT;
  command->scan_end_arg = count;
  command->stop_src = TRIG_COUNT;
  command->stop_arg = 2;
  return 0;
}
int comedi_command_test(comedi_t*, comedi_cmd* command) {
  const std::lock_guard lock(board().mutex);
  if (command->chanlist == nullptr || command->chanlist_len != command->scan_end_arg) return 3;
  if (command->stop_src == TRIG_NONE && command->stop_arg != 0) return 3;
  if (command->scan_begin_arg < board().fastest_ns) {
    command->scan_begin_arg = board().fastest_ns;
    return 4;
  }
  return 0;
}
int comedi_command(comedi_t* device, comedi_cmd* command) {
  std::uint64_t number = 0;
  std::vector<unsigned> channels(command->chanlist, command->chanlist + command->chanlist_len);
  {
    const std::lock_guard lock(board().mutex);
    if (board().busy || !board().streaming.empty()) return fail(EBUSY);
    int ends[2];
    if (pipe2(ends, 0) != 0) return fail(errno);
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    device->read_end = ends[0];
    device->write_end = ends[1];
    number = ++board().commands;
    board().channels = channels;
    board().wakes_every_scan = (command->flags & CMDF_WAKE_EOS) != 0;
    board().streaming.insert(device->read_end);
  }
  device->stop.store(false);
  device->pump = std::thread(pump, device, number, std::move(channels), command->scan_begin_arg);
  return 0;
}
int comedi_cancel(comedi_t* device, unsigned int) {
  end(device);
  return 0;
}

int comedi_do_insnlist(comedi_t*, comedi_insnlist* list) {
  const std::lock_guard lock(board().mutex);
  if (board().failing) return fail(EIO);
  auto* const page = world();
  look_at_world();
  for (unsigned k = 0; k < list->n_insns; ++k) {
    comedi_insn& instruction = list->insns[k];
    const unsigned channel = CR_CHAN(instruction.chanspec);
    if (instruction.insn == INSN_READ && instruction.subdev == 3 && channel < 8) {
      instruction.data[0] = board().counters[channel];
      if (page != nullptr && k == 0) page->operator->()->counter_reads.fetch_add(1);
    } else if (instruction.insn == INSN_WRITE && instruction.subdev == 1 && channel < 4) {
      board().outputs[channel] = instruction.data[0];
      if (page != nullptr) page->operator->()->outputs[channel].store(instruction.data[0]);
    } else {
      return static_cast<int>(k);
    }
  }
  return static_cast<int>(list->n_insns);
}
int comedi_data_write(comedi_t*, unsigned int subdevice, unsigned int channel, unsigned int, unsigned int,
                      lsampl_t data) {
  note("write " + std::to_string(subdevice) + " " + std::to_string(channel) + " " + std::to_string(data));
  return 1;
}
int comedi_reset(comedi_t*, unsigned subdevice) {
  note("reset " + std::to_string(subdevice));
  return 0;
}
int comedi_set_gate_source(comedi_t*, unsigned subdevice, unsigned, unsigned gate, unsigned) {
  note("gate " + std::to_string(subdevice) + " " + std::to_string(gate));
  return 0;
}
int comedi_set_counter_mode(comedi_t*, unsigned subdevice, unsigned, unsigned mode) {
  note("mode " + std::to_string(subdevice) + " " + std::to_string(mode));
  return 0;
}
int comedi_arm(comedi_t*, unsigned subdevice, unsigned) {
  note("arm " + std::to_string(subdevice));
  return 0;
}

}  // extern "C"
