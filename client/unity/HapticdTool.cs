// Moves a Unity object as the tool of a hapticd rig, where it will be when the picture is seen.
//
// Needs the packages Grpc.Net.Client and Google.Protobuf, an HTTP/2 handler, and the messages that protoc makes of
// proto/hapticd/v1 (README.md). Put it on the object that stands for the tool: its origin is the tip, its y axis points to
// the tool's end. C# 7.3, which all current versions of Unity compile.

using System;
using System.Diagnostics;
using System.IO;
using System.Net.Http;
using System.Threading;
using System.Threading.Tasks;
using Google.Protobuf;
using Grpc.Core;
using Grpc.Net.Client;
using Hapticd.V1;
using UnityEngine;
// Names that Unity and the messages share.
using Pose = Hapticd.V1.Pose;

public sealed class HapticdTool : MonoBehaviour
{
    [Tooltip("The daemon: http:// on this machine, https:// elsewhere, which needs certificates (docs/access.md)")]
    public string address = "http://127.0.0.1:50051";
    [Tooltip("With https: the folder with client.crt, client.key and authority.crt")]
    public string certificates = "";
    [Tooltip("From here to light, in ms: rendering, compositor, display")]
    public double displayMs = 20;
    /// Is called when the tool touches: its number, and how many ms ago it began.
    public event Action<uint, double> Touched;

    /// Makes the HTTP/2 handler, which Unity has not: from the texts of authority.crt, client.crt and client.key, which are
    /// null without certificates. To be set before the object is enabled.
    public delegate HttpMessageHandler HandlerMaker(string authority, string certificate, string key);
    public static HandlerMaker MakeHandler;

    /// How far off the tool may be, in m (one standard deviation).
    public float ErrorMetres { get; private set; }

    GrpcChannel channel;
    CallInvoker invoker;
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
        if (MakeHandler == null)
        {
            UnityEngine.Debug.LogError("hapticd: set HapticdTool.MakeHandler to what makes an HTTP/2 handler (client/unity/README.md)");
            enabled = false;
            return;
        }
        var secured = certificates != "";
        Func<string, string> textOf = file => secured ? File.ReadAllText(Path.Combine(certificates, file)) : null;
        var handler = MakeHandler(textOf("authority.crt"), textOf("client.crt"), textOf("client.key"));
        channel = GrpcChannel.ForAddress(address, new GrpcChannelOptions { HttpHandler = handler, DisposeHttpClient = true });
        invoker = channel.CreateCallInvoker();
        ending = new CancellationTokenSource();
        _ = Read(ending.Token);
        _ = KeepClock(ending.Token);
    }

    void OnDisable()
    {
        ending?.Cancel();
        channel?.Dispose();
        ending = null;
        channel = null;
    }

    // The two calls, as Debian has no program that makes them of the services.
    static readonly Method<SubscribePosesRequest, Pose> subscribe =
        MethodOf<SubscribePosesRequest, Pose>(MethodType.ServerStreaming, "hapticd.v1.PoseService", "Subscribe", Pose.Parser);
    static readonly Method<ExchangeRequest, ExchangeResponse> exchange =
        MethodOf<ExchangeRequest, ExchangeResponse>(MethodType.Unary, "hapticd.v1.ClockService", "Exchange", ExchangeResponse.Parser);

    static Method<Request, Answer> MethodOf<Request, Answer>(MethodType type, string service, string name, MessageParser<Answer> parser)
        where Request : class, IMessage<Request> where Answer : class, IMessage<Answer> =>
        new Method<Request, Answer>(type, service, name,
            Marshallers.Create<Request>(message => message.ToByteArray(), bytes => { throw new NotSupportedException(); }),
            Marshallers.Create<Answer>(message => message.ToByteArray(), parser.ParseFrom));

    // Reads without rest, so that the newest pose is never an old one. Begins again when the daemon was away.
    async Task Read(CancellationToken end)
    {
        var request = new SubscribePosesRequest { RateHz = 120, PredictMs = displayMs };
        while (!end.IsCancellationRequested)
        {
            try
            {
                using (var call = invoker.AsyncServerStreamingCall(subscribe, null, new CallOptions(cancellationToken: end), request))
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
        while (!end.IsCancellationRequested)
        {
            try
            {
                var sent = NowNs();
                var request = new ExchangeRequest { ClientSentNs = sent };
                var answer = await invoker.AsyncUnaryCall(exchange, null, new CallOptions(cancellationToken: end), request);
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
        var aheadS = Math.Max(-0.05, Math.Min(0.05, 1e-9 * (daemonNow + 1e6 * displayMs - pose.Time.DaemonNs)));
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
