// A motor drive behind Modbus to try a turntable with: hapticd_emulated_drive --tcp PORT | --rtu [--az]
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>

#include "tests/emulators/modbus/emulated_drive.h"

int main(int argc, char** argv) {
  using hapticd::test::EmulatedDrive;
  EmulatedDrive::Options options{.tcp_port = -1};
  CLI::App app("A motor drive behind Modbus. Ends with SIGINT or SIGTERM.", "hapticd_emulated_drive");
  app.add_option("--tcp", options.tcp_port, "listen on this port of 127.0.0.1 (0 = any free port)");
  app.add_flag("--rtu", options.serial, "open a pty pair and show the port a master may open");
  app.add_option("--unit", options.unit, "the drive's number")->capture_default_str();
  bool az = false;
  app.add_flag("--az", az, "speak the registers of an Oriental Motor AZ, not of 'plain_drive'");
  constexpr int kBadCommandLine = 2;
  try {
    app.parse(argc, argv);
    if (options.tcp_port < 0 && !options.serial) throw CLI::RequiredError("--tcp or --rtu");
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : kBadCommandLine;
  }
  if (az) options.make = EmulatedDrive::Make::kOrientalAz;
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    const EmulatedDrive drive(options);
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
