// SPDX-License-Identifier: MIT
// Passes of SrbfSurfelPasses and SrbfShapePasses, by number. In a folder Resources, so that builds have it.
Shader "Hidden/Srbf/Surfels"
{
    SubShader
    {
        Cull Off
        ZWrite Off
        ZTest Always

        HLSLINCLUDE
        #pragma target 3.5
        #include "../Shaders/SrbfSurfels.hlsl"
        ENDHLSL

        Pass
        {
            Name "Occluders on a cube"
            BlendOp Max
            Blend One One
            HLSLPROGRAM
            #pragma vertex SrbfOccluderOnCube
            #pragma fragment SrbfNearness
            ENDHLSL
        }
        Pass
        {
            Name "Occluders on a map"
            BlendOp Max
            Blend One One
            HLSLPROGRAM
            #pragma vertex SrbfOccluderOnMap
            #pragma fragment SrbfHeight
            ENDHLSL
        }
        Pass
        {
            Name "Irradiance by cube"
            Blend One One
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfIrradianceByCube
            ENDHLSL
        }
        Pass
        {
            Name "Irradiance by map"
            Blend One One
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfIrradianceByMap
            ENDHLSL
        }
        Pass
        {
            Name "Means"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfMeans
            ENDHLSL
        }
        Pass
        {
            Name "Table parts"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfTableParts
            ENDHLSL
        }
        Pass
        {
            Name "Table sums"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfTableSums
            ENDHLSL
        }
        Pass
        {
            Name "Cells of directions"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfCells
            ENDHLSL
        }
        Pass
        {
            Name "Product"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfProduct
            ENDHLSL
        }
        Pass
        {
            Name "Exchange"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfExchange
            ENDHLSL
        }
        Pass
        {
            Name "Repainted table"
            HLSLPROGRAM
            #pragma vertex SrbfFullscreen
            #pragma fragment SrbfRepainted
            ENDHLSL
        }
    }
}
