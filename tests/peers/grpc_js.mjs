// What a user of grpc-js writes: calls, telemetry, refusals in all their parts, and a quiet stream with keepalive.
//
//   node grpc_js.mjs FOLDER_OF_PACKAGES FOLDER_OF_THE_CONTRACT ADDRESS
import assert from 'node:assert/strict';
import {createRequire} from 'node:module';
import {readdirSync} from 'node:fs';
import path from 'node:path';

const [packages, contract, address] = process.argv.slice(2);
const load = createRequire(path.join(path.resolve(packages), 'node_modules', 'x.js'));
const grpc = load('@grpc/grpc-js');
const loader = load('@grpc/proto-loader');
const protobuf = load('protobufjs');

const files = readdirSync(path.join(contract, 'hapticd/v1')).filter((name) => name.endsWith('.proto')).map((name) => 'hapticd/v1/' + name);
const {hapticd: {v1}} = grpc.loadPackageDefinition(loader.loadSync(files, {includeDirs: [contract], keepCase: true, longs: String, enums: String, defaults: true, oneofs: true}));
const types = new protobuf.Root();
types.resolvePath = (_, file) => path.join(contract, file.startsWith('google/protobuf') ? '../' + file : file);
types.loadSync(['google/rpc/status.proto', 'hapticd/v1/common.proto'], {keepCase: true});
const Status = types.lookupType('google.rpc.Status');
const ErrorDetail = types.lookupType('hapticd.v1.ErrorDetail');

// Pings more often than some streams have data.
const options = {'grpc.keepalive_time_ms': 6000, 'grpc.keepalive_timeout_ms': 3000, 'grpc.keepalive_permit_without_calls': 1};
const client = (name) => new v1[name](address, grpc.credentials.createInsecure(), options);
const call = (service, method, request = {}) => new Promise((resolve, reject) => {
  service[method](request, {deadline: Date.now() + 20000}, (error, answer) => (error ? reject(error) : resolve(answer)));
});

/// The detail of a refusal, from the trailer that carries it.
async function refused(service, method, request) {
  const error = await call(service, method, request).then(() => assert.fail(`${method} was not refused`), (e) => e);
  const [trailer] = error.metadata.get('grpc-status-details-bin');
  assert.ok(trailer, `${method}: no trailer: ${error.message}`);
  const [any] = Status.decode(trailer).details;
  assert.ok(any.type_url.endsWith('/hapticd.v1.ErrorDetail'));
  return ErrorDetail.toObject(ErrorDetail.decode(any.value), {enums: String});
}

const rendering = client('RenderingService');
const scenes = client('SceneService');
const info = await call(client('RigService'), 'GetRigInfo');
assert.equal(info.kind, 'RIG_KIND_SIMULATED');

const early = await refused(rendering, 'SetTarget', {stiffness_n_per_mm: 0.5});
assert.match(early.what, /no scene/);
assert.ok(early.remedy);
assert.equal((await refused(scenes, 'LoadScene', {name: 'tap_1e'})).reason, 'ERROR_REASON_NOT_FOUND');
await call(scenes, 'LoadScene', {name: 'tap_1d'});
const granted = await call(rendering, 'SetTarget', {stiffness_n_per_mm: 0.5});
assert.ok(Math.abs(granted.granted_n_per_mm - 0.5) < 1e-9);
const wild = await refused(rendering, 'SetTarget', {stiffness_n_per_mm: -1});
assert.equal(wild.reason, 'ERROR_REASON_OUT_OF_RANGE');
assert.ok(wild.where && wild.limit && wild.value, JSON.stringify(wild));
await refused(rendering, 'SetTarget', {stiffness_n_per_mm: NaN});

// A quiet stream, kept alive by pings, while another one is not quiet at all.
const quiet = client('LeaseService').WatchLease({});
let quietEnd = null;
quiet.on('data', () => {});
quiet.on('error', (error) => { quietEnd ??= error; });
quiet.on('end', () => { quietEnd ??= new Error('it ended'); });

const samples = await new Promise((resolve, reject) => {
  let last = null, count = 0;
  const stream = client('TelemetryService').Subscribe({groups: ['FIELD_GROUP_CONTACT'], decimation: 1});
  stream.on('error', (error) => (count < 2000 ? reject(error) : null));
  stream.on('data', (batch) => {
    for (const sample of batch.samples) {
      const tick = BigInt(sample.tick);
      if (last !== null && tick !== last + 1n) reject(new Error(`after tick ${last} comes ${tick}`));
      last = tick;
      count++;
    }
    if (count >= 2000) {
      stream.cancel();
      resolve(count);
    }
  });
});
await new Promise((resolve) => setTimeout(resolve, 26000));
assert.equal(quietEnd, null, `the quiet stream was ended: ${quietEnd}`);
quiet.cancel();
console.log(`grpc-js: ${samples} samples without a gap, four refusals in full, a quiet stream for 26 s`);
process.exit(0);
