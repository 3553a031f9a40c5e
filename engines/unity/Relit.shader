// SPDX-License-Identifier: MIT
// One relit surface, otherwise unlit: albedo times the asset's response to the lights. Runs in the built-in pipeline and in URP, which
// draws passes without a LightMode; in HDRP use a Shader Graph with SrbfAsset.hlsl.
Shader "Srbf/Relit @ID@"
{
    Properties
    {
        _MainTex ("Albedo", 2D) = "white" {}
        _Color ("Tint", Color) = (1, 1, 1, 1)
        [Toggle] _SecondUv ("Lightmap in the second UV set", Float) = 1
    }
    SubShader
    {
        Tags { "RenderType" = "Opaque" }
        Pass
        {
            HLSLPROGRAM
            #pragma target 3.5
            #pragma vertex Vertex
            #pragma fragment Fragment
            #include "UnityCG.cginc"
            #include "SrbfAsset.hlsl"

            Texture2D _MainTex;
            SamplerState sampler_MainTex;
            float4 _MainTex_ST;
            float4 _Color;
            float _SecondUv;

            struct Corner
            {
                float4 vertex : POSITION;
                float2 uv : TEXCOORD0;
                float2 second : TEXCOORD1;
            };

            struct Surface
            {
                float4 position : SV_POSITION;
                float2 uv : TEXCOORD0;
                float2 lightmap : TEXCOORD1;
                float3 world : TEXCOORD2;
            };

            Surface Vertex(Corner corner)
            {
                Surface surface;
                surface.position = UnityObjectToClipPos(corner.vertex.xyz);
                surface.uv = TRANSFORM_TEX(corner.uv, _MainTex);
                surface.lightmap = _SecondUv > 0.5 ? corner.second : corner.uv;
                surface.world = mul(unity_ObjectToWorld, float4(corner.vertex.xyz, 1.0)).xyz;
                return surface;
            }

            float4 Fragment(Surface surface) : SV_Target
            {
                float3 albedo = SRBF_ALBEDO(_MainTex.Sample(sampler_MainTex, surface.uv).rgb * _Color.rgb);
                return float4(albedo * SrbfRelit(surface.lightmap, surface.world), 1.0);
            }
            ENDHLSL
        }
    }
    FallBack "VertexLit"
}
