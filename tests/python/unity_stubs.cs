// The published signatures that client/unity uses, without their bodies: UnityEngine.CoreModule, Grpc.Core.Api,
// Grpc.Net.Client, Google.Protobuf, YetAnotherHttpHandler, and System.Net.Http, which mono has in another package.

namespace System.Net.Http
{
    public abstract class HttpMessageHandler { }
}

namespace UnityEngine
{
    [System.AttributeUsage(System.AttributeTargets.Field)]
    public class TooltipAttribute : System.Attribute { public TooltipAttribute(string tooltip) { } }
    public enum RuntimeInitializeLoadType { AfterSceneLoad, BeforeSceneLoad }
    [System.AttributeUsage(System.AttributeTargets.Method)]
    public class RuntimeInitializeOnLoadMethodAttribute : System.Attribute
    {
        public RuntimeInitializeOnLoadMethodAttribute(RuntimeInitializeLoadType loadType) { }
    }
    public struct Pose { public Vector3 position; public Quaternion rotation; }
    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static float Dot(Vector3 lhs, Vector3 rhs) { return 0; }
        public static Vector3 operator +(Vector3 a, Vector3 b) { return a; }
        public static Vector3 operator -(Vector3 a, Vector3 b) { return a; }
        public static Vector3 operator *(Vector3 a, float d) { return a; }
    }
    public struct Quaternion
    {
        public float x, y, z, w;
        public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
    }
    public struct Mathf
    {
        public static float Sqrt(float f) { return f; }
    }
    public class Object { }
    public class Component : Object { public Transform transform { get { return null; } } }
    public class Transform : Component
    {
        public void SetPositionAndRotation(Vector3 position, Quaternion rotation) { }
    }
    public class Behaviour : Component { public bool enabled { get; set; } }
    public class MonoBehaviour : Behaviour { }
    public class Debug
    {
        public static void LogWarning(object message) { }
        public static void LogError(object message) { }
    }
    public class Random { }
}

namespace Google.Protobuf
{
    public interface IMessage { }
    public interface IMessage<T> : IMessage where T : IMessage<T> { }
    public class MessageParser<T> where T : IMessage<T> { public T ParseFrom(byte[] data) { return default(T); } }
    public static class MessageExtensions { public static byte[] ToByteArray(this IMessage message) { return null; } }
}

namespace Grpc.Core
{
    using System;
    using System.Runtime.CompilerServices;
    using System.Threading;
    using System.Threading.Tasks;

    public enum StatusCode { OK, Cancelled, Unavailable = 14 }
    public struct Status { public StatusCode StatusCode { get { return 0; } } public string Detail { get { return null; } } }
    public class RpcException : Exception
    {
        public Status Status { get { return default(Status); } }
        public StatusCode StatusCode { get { return 0; } }
    }
    public enum MethodType { Unary, ClientStreaming, ServerStreaming, DuplexStreaming }
    public class Marshaller<T> { }
    public static class Marshallers
    {
        public static Marshaller<T> Create<T>(Func<T, byte[]> serializer, Func<byte[], T> deserializer) { return null; }
    }
    public class Method<TRequest, TResponse>
    {
        public Method(MethodType type, string serviceName, string name, Marshaller<TRequest> requestMarshaller,
            Marshaller<TResponse> responseMarshaller) { }
    }
    public class Metadata { }
    public struct CallOptions
    {
        public CallOptions(Metadata headers = null, DateTime? deadline = null,
            CancellationToken cancellationToken = default(CancellationToken)) { }
    }
    public interface IAsyncStreamReader<out T>
    {
        T Current { get; }
        Task<bool> MoveNext(CancellationToken cancellationToken);
    }
    public sealed class AsyncServerStreamingCall<TResponse> : IDisposable
    {
        public IAsyncStreamReader<TResponse> ResponseStream { get { return null; } }
        public void Dispose() { }
    }
    public sealed class AsyncUnaryCall<TResponse> : IDisposable
    {
        public TaskAwaiter<TResponse> GetAwaiter() { return default(TaskAwaiter<TResponse>); }
        public void Dispose() { }
    }
    public abstract class CallInvoker
    {
        public abstract AsyncUnaryCall<TResponse> AsyncUnaryCall<TRequest, TResponse>(
            Method<TRequest, TResponse> method, string host, CallOptions options, TRequest request)
            where TRequest : class where TResponse : class;
        public abstract AsyncServerStreamingCall<TResponse> AsyncServerStreamingCall<TRequest, TResponse>(
            Method<TRequest, TResponse> method, string host, CallOptions options, TRequest request)
            where TRequest : class where TResponse : class;
    }
    public abstract class ChannelBase { public abstract CallInvoker CreateCallInvoker(); }
}

namespace Grpc.Net.Client
{
    public sealed class GrpcChannelOptions
    {
        public System.Net.Http.HttpMessageHandler HttpHandler { get; set; }
        public bool DisposeHttpClient { get; set; }
    }
    public sealed class GrpcChannel : Grpc.Core.ChannelBase, System.IDisposable
    {
        public static GrpcChannel ForAddress(string address, GrpcChannelOptions channelOptions) { return null; }
        public override Grpc.Core.CallInvoker CreateCallInvoker() { return null; }
        public void Dispose() { }
    }
}

namespace Cysharp.Net.Http
{
    public class YetAnotherHttpHandler : System.Net.Http.HttpMessageHandler
    {
        public bool? Http2Only { get; set; }
        public string RootCertificates { get; set; }
        public string ClientAuthCertificates { get; set; }
        public string ClientAuthKey { get; set; }
    }
}
