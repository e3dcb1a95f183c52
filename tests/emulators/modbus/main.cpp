// A motor drive behind Modbus to try a turntable with: hapticd_emulated_drive --tcp PORT | --rtu [--az]
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>

#include "tests/emulators/modbus/emulated_drive.h"

namespace {

int usage() {
  std::fputs(
      "hapticd_emulated_drive - a motor drive behind Modbus\n"
      "  --tcp PORT   listen on 127.0.0.1:PORT (0 = any free port)\n"
      "  --rtu        open a pty pair and show the port a master may open\n"
      "  --unit N     the drive's number, 1 unless set otherwise\n"
      "  --az         speak the registers of an Oriental Motor AZ instead of those of map 'plain_drive'\n"
      "Ends with SIGINT or SIGTERM.\n",
      stderr);
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  hapticd::test::EmulatedDrive::Options options{.tcp_port = -1};
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--tcp" && i + 1 < argc) {
      options.tcp_port = std::atoi(argv[++i]);
    } else if (word == "--unit" && i + 1 < argc) {
      options.unit = std::atoi(argv[++i]);
    } else if (word == "--rtu") {
      options.serial = true;
    } else if (word == "--az") {
      options.make = hapticd::test::EmulatedDrive::Make::kOrientalAz;
    } else {
      return usage();
    }
  }
  if (options.tcp_port < 0 && !options.serial) return usage();
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    const hapticd::test::EmulatedDrive drive(options);
    if (options.tcp_port >= 0) std::printf("tcp 127.0.0.1:%d unit %d\n", drive.port(), options.unit);
    if (options.serial) std::printf("rtu %s unit %d\n", drive.serial_port().c_str(), options.unit);
    std::fflush(stdout);
    int signal = 0;
    sigwait(&signals, &signal);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hapticd_emulated_drive: %s\n", error.what());
    return 1;
  }
  return 0;
}
