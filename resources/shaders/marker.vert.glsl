//VTK::System::Dec
in vec4 vertexMC;
in vec4 scalarColor;
out vec4 colorVS;

void main()
{
  gl_Position = vertexMC;
  colorVS = scalarColor;
}
