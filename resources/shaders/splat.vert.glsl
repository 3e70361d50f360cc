//VTK::System::Dec
// One GL point per splat: everything is handed on to the geometry shader.
in vec4 vertexMC;     // centre
in vec3 axisU;        // in-plane axes, one standard deviation long
in vec3 axisV;
in vec2 shape;        // standard deviation along the normal; cutoff radius in standard deviations
in float flags;       // bit 0 selected, 1 hidden, 2 highlighted
in vec4 scalarColor;
out vec3 axisUVS;
out vec3 axisVVS;
out vec2 shapeVS;
out vec4 colorVS;
out float flagsVS;

void main()
{
  gl_Position = vertexMC;
  axisUVS = axisU;
  axisVVS = axisV;
  shapeVS = shape;
  colorVS = scalarColor;
  flagsVS = flags;
}
