#include "server/command_line.h"

#include <CLI/CLI.hpp>

#include "proto/text/usage_message.h"
#include "server/daemon.h"
#include "server/process/version.h"

namespace hapticd::server {

std::optional<CommandLine> read_command_line(int argc, char** argv, int& exit_code) {
  CommandLine line;
  ConfigOverrides& overrides = line.overrides;
  CLI::App app("hapticd renders the stiffness of real objects and serves it over gRPC.", "hapticd");
  app.set_version_flag("--version", std::string("hapticd ") + version());
  app.add_option("--config", line.config_file, "Configuration file (TOML); the options below go before it")
      ->type_name("FILE");
  app.add_option(
         "--rig", overrides.rig,
         "sim, sim:PRESET (phantom_1_0, phantom_1_5_high_force), with :lab for drift, vibration and the "
         "like, :general for objects of other laws (sim:PRESET:lab:general), or replay:PATH of a "
         "recording (MCAP or CSV), "
         "e.g. 'replay:run.csv?force=load_uN&position=tip_um&speed=recorded&loop=true'")
      ->type_name("RIG");
  app.add_option("--listen", overrides.listen,
                 "Loopback address to listen on; port 0 takes a free one [127.0.0.1:50051]")
      ->type_name("HOST:PORT");
  app.add_option("--unix", overrides.unix_socket, "Unix socket to listen on as well")->type_name("PATH");
  app.add_option("--listen-tls", overrides.listen_tls,
                 "Address to listen on with certificates, e.g. 192.168.1.20:50051")
      ->type_name("ADDRESS:PORT");
  app.add_option("--certificates", overrides.certificates,
                 "Folder of server.crt, server.key and authority.crt, read again when they change")
      ->type_name("DIR");
  app.add_option("--scene", overrides.scene, "Scene to start with")->type_name("NAME");
  app.add_option("--scenes", overrides.scene_folder, "Folder of further scenes (NAME.toml)")
      ->type_name("DIR");
  app.add_option("--models", overrides.model_folder, "Folder of further models of objects (NAME.toml)")
      ->type_name("DIR");
  app.add_option(
         "--model-store", overrides.model_store,
         "Where identified models are kept, :memory: = nowhere "
         "[$STATE_DIRECTORY, else $XDG_STATE_HOME/hapticd, else ~/.local/state/hapticd, /models.sqlite]")
      ->type_name("FILE");
  app.add_option("--rate-hz", overrides.rate_hz, "Rate of the loop, 500 … 10000 Hz [1000]")->type_name("HZ");
  app.add_option("--log-level", overrides.log_level, "debug, info, warning, error, off [info]")
      ->type_name("LEVEL");
  app.add_flag("--check-config", line.check_config,
               "Check configuration, rig and scene, print all of it, and exit");
  app.footer(
      "Examples:\n"
      "  hapticd --rig sim --scene tap_1d\n"
      "  hapticd --config /etc/hapticd.toml --check-config\n"
      "  hapticd --rig 'replay:cycle_3.csv?loop=true' --scene tap_1d --listen 127.0.0.1:0\n\n"
      "Exit codes: 0 clean, 2 bad command line or configuration, 3 cannot listen (another daemon?), 4 rig "
      "cannot be "
      "opened.");
  app.failure_message(text::usage_message);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool said_all = app.exit(error) == 0;  // help or version
    exit_code = static_cast<int>(said_all ? ExitCode::kClean : ExitCode::kBadConfiguration);
    return std::nullopt;
  }
  return line;
}

}  // namespace hapticd::server
