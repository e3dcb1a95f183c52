// Moves a Unity object as the tool of a hapticd rig, where it will be when the picture is seen.
//
// Needs the packages Grpc.Net.Client and Google.Protobuf, and the C# that protoc makes of proto/hapticd/v1 (README.md).
// Put it on the object that stands for the tool: its origin is the tip, its y axis points to the tool's end.

using System;
using System.Diagnostics;
using System.Threading;
using System.Threading.Tasks;
using Grpc.Core;
using Grpc.Net.Client;
using Hapticd.V1;
using UnityEngine;

public sealed class HapticdTool : MonoBehaviour
{
    [Tooltip("The daemon; beyond this machine it needs TLS, see docs/access.md")]
    public string address = "http://127.0.0.1:50051";
    [Tooltip("From here to light, in ms: rendering, compositor, display")]
    public double displayMs = 20;
    [Tooltip("Is called when the tool touches: its number, and how many ms ago it began")]
    public event Action<uint, double> Touched;

    /// How far off the tool may be, in m (one standard deviation).
    public float ErrorMetres { get; private set; }

    GrpcChannel channel;
    CancellationTokenSource ending;
    volatile Pose newest;
    uint lastContact;
    // Bounds of the daemon's clock minus this one's, in ns; they hold for any delay of the network.
    long lower = long.MinValue, upper = long.MaxValue;
    long boundsAt;
    const double MaxDrift = 200e-6;

    static long NowNs() => (long)(Stopwatch.GetTimestamp() * (1e9 / Stopwatch.Frequency));

    void OnEnable()
    {
        channel = GrpcChannel.ForAddress(address);
        ending = new CancellationTokenSource();
        _ = Read(ending.Token);
        _ = KeepClock(ending.Token);
    }

    void OnDisable()
    {
        ending.Cancel();
        channel.Dispose();
    }

    // Reads without rest, so that the newest pose is never an old one. Begins again when the daemon was away.
    async Task Read(CancellationToken end)
    {
        var request = new SubscribePosesRequest { RateHz = 120, PredictMs = displayMs };
        while (!end.IsCancellationRequested)
        {
            try
            {
                using var call = new PoseService.PoseServiceClient(channel).Subscribe(request, cancellationToken: end);
                while (await call.ResponseStream.MoveNext(end)) newest = call.ResponseStream.Current;
            }
            catch (RpcException error) when (error.StatusCode != StatusCode.Cancelled)
            {
                UnityEngine.Debug.LogWarning($"hapticd: {error.Status.Detail}");
                await Task.Delay(1000, end);
            }
        }
    }

    async Task KeepClock(CancellationToken end)
    {
        var clock = new ClockService.ClockServiceClient(channel);
        while (!end.IsCancellationRequested)
        {
            try
            {
                var sent = NowNs();
                var answer = await clock.ExchangeAsync(new ExchangeRequest { ClientSentNs = sent }, cancellationToken: end);
                var received = NowNs();
                // A message does not arrive before it was sent.
                var widen = (long)(MaxDrift * (received - boundsAt));
                var newLower = answer.DaemonSentNs - received;
                var newUpper = answer.DaemonReceivedNs - sent;
                lower = lower == long.MinValue ? newLower : Math.Max(lower - widen, newLower);
                upper = upper == long.MaxValue ? newUpper : Math.Min(upper + widen, newUpper);
                if (lower > upper) (lower, upper) = (newLower, newUpper);  // another machine, or a clock that was set
                boundsAt = received;
            }
            catch (RpcException) { }
            await Task.Delay(200, end);
        }
    }

    // The rig has z up, y away from the user, and mm; Unity has y up, z away, and m, and is left-handed.
    static UnityEngine.Vector3 ToUnity(Hapticd.V1.Vector3 v) => new UnityEngine.Vector3((float)v.X, (float)v.Z, (float)v.Y) * 0.001f;
    static UnityEngine.Quaternion ToUnity(Hapticd.V1.Quaternion q) =>
        new UnityEngine.Quaternion((float)-q.X, (float)-q.Z, (float)-q.Y, (float)q.W);

    void LateUpdate()
    {
        var pose = newest;
        if (pose == null || lower == long.MinValue || !pose.Time.HasDaemonNs) return;
        var daemonNow = NowNs() + (lower + upper) / 2;
        // What is left between the instant the pose is for and the one the picture is for.
        var aheadS = Math.Clamp(1e-9 * (daemonNow + 1e6 * displayMs - pose.Time.DaemonNs), -0.05, 0.05);
        var velocity = ToUnity(pose.VelocityMmPerS);
        if (pose.Normal != null)
        {
            var normal = new UnityEngine.Vector3((float)pose.Normal.X, (float)pose.Normal.Z, (float)pose.Normal.Y);
            velocity -= normal * UnityEngine.Vector3.Dot(normal, velocity);  // the object holds the tip
        }
        transform.SetPositionAndRotation(ToUnity(pose.PositionMm) + velocity * (float)aheadS, ToUnity(pose.Orientation));
        var c = pose.PositionCovarianceMm2;
        ErrorMetres = 0.001f * Mathf.Sqrt((float)Math.Max(0, c.Xx + c.Yy + c.Zz));
        if (pose.Contact != null && pose.Contact.Number != lastContact)
        {
            lastContact = pose.Contact.Number;
            Touched?.Invoke(lastContact, 1e-6 * (daemonNow - pose.Contact.Began.DaemonNs));
        }
    }
}
